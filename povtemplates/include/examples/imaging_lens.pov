// A lens on a table before a checker: what is seen through it is upright and larger, as by a reading glass. Its rim is
// black: what passes beside the glass is stopped.
//
//   povray +Iimaging_lens.pov +L.. +W320 +H240
//
// Units: mm.

#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 10 }

#include "lippmann/glass.inc"
#include "lippmann/imaging_lens.inc"
#include "lippmann/stage.inc"

// Two surfaces: radius, thickness to the next vertex, index behind, semi-aperture. Focal length 101 mm.
#declare Reading_Glass = array[2][4] {
  {  100, 10, 1.5, 30 },
  { -100,  0, 1.0, 30 }
};

// The baffles reach out to 20 semi-apertures; a ring of them is enough here.
intersection {
  object { Lippmann_Imaging_Lens(Reading_Glass) }
  cylinder { -20 * z, 30 * z, 34 texture { Lippmann_Clear } }
  Lippmann_Invisible_To_The_Scene()
  Lippmann_Stage(<0, 40, 0>, <0, 40, 60>, y, 1)
}

// The handle, the table and what is looked at.
cylinder { <0, 0, -5>, <0, 8, -5>, 4 pigment { rgb <0.4, 0.2, 0.1> } }
plane { y, 0 pigment { rgb <0.7, 0.6, 0.5> } }
box { <-80, 0, 60>, <80, 90, 62> pigment { checker rgb 0.95 rgb <0.1, 0.3, 0.6> scale 10 } }

light_source { <-200, 400, -300>, 1 }
background { rgb <0.6, 0.7, 0.9> }
camera { location <0, 60, -200> look_at <0, 40, 0> angle 42 }
