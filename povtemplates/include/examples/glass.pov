// What the optics are made of: a ball of clear glass and a black ring. Neither casts a shadow on the floor.
//
//   povray +Iglass.pov +L.. +W320 +H240
//
// Units: mm.

#version 3.7;
global_settings { assumed_gamma 1 }

#include "lippmann/glass.inc"

sphere {
  <-30, 40, 0>, 30
  texture { Lippmann_Clear }
  interior { ior 1.5 }
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
