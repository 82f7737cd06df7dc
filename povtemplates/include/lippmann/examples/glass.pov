// A ball of clear glass and a black ring, the two materials of optical parts. Neither casts a shadow on the floor.
//
//   povray +Iglass.pov +L../.. +W320 +H240
//
// Licence: MIT. Run the command in this folder. Units: mm.

#version 3.7;
global_settings { assumed_gamma 1 }

#include "lippmann/glass.inc"

// The glass is Schott N-BK7 by its data sheet: index 1.5168, Abbe number 64.17.
sphere {
  <-30, 40, 0>, 30
  texture { Lippmann_Clear }
  Lippmann_Glass(1.5168, Lippmann_Dispersion(1.5168, 64.17))
  Lippmann_Invisible_To_The_Scene()
}

torus {
  25, 5
  rotate 90 * x
  translate <40, 40, 0>
  texture { Lippmann_Black }
  Lippmann_Invisible_To_The_Scene()
}

plane { y, 0 pigment { checker rgb <0.9, 0.8, 0.6> rgb <0.3, 0.4, 0.5> scale 15 } }
light_source { <-200, 400, -300>, 1 }
background { rgb <0.6, 0.7, 0.9> }
camera { location <0, 90, -220> look_at <5, 30, 0> angle 40 }
