// A reading glass on a table before a checkered board. Through the lens the board is upright and larger. The black
// baffle around the rim stops the rays that pass beside the glass.
//
//   povray +Iimaging_lens.pov +L../.. +W320 +H240
//
// Licence: MIT. Run the command in this folder. Units: mm.

#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 10 }

#include "lippmann/stage.inc"

// A baffle reaches 20 semi-apertures from the axis by default. Here a narrow ring is enough.
#declare Lippmann_Baffle_Reach = 1.15;
#include "lippmann/imaging_lens.inc"

// The focal length is 101 mm, the diameter is 60 mm, and the refractive index is 1.5.
object {
  Lippmann_Imaging_Lens(Lippmann_Plano_Convex(101, 60, 1.5))
  Lippmann_Stage(<0, 40, 0>, <0, 40, 60>, y, 1)
}

// The handle, the table and the board.
cylinder { <0, 0, -5>, <0, 8, -5>, 4 pigment { rgb <0.4, 0.2, 0.1> } }
plane { y, 0 pigment { rgb <0.7, 0.6, 0.5> } }
box { <-80, 0, 60>, <80, 90, 62> pigment { checker rgb 0.95 rgb <0.1, 0.3, 0.6> scale 10 } }

light_source { <-200, 400, -300>, 1 }
background { rgb <0.6, 0.7, 0.9> }
camera { location <0, 60, -200> look_at <0, 40, 0> angle 42 }
