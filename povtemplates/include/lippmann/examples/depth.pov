// The distances of a ball, a ring and the ground, as fog: near things are dark, and blue shows that there is a
// distance.
//
//   povray +Idepth.pov +L../.. +W320 +H240
//
// Licence: MIT. Run the command in this folder.

#version 3.7;

// Only the distance to the first object along a ray counts, and the picture is linear in light.
global_settings { assumed_gamma 1 max_trace_level 1 }

#include "lippmann/depth.inc"

sphere { <-30, 40, 0>, 40 pigment { checker rgb 1 rgb <0.2, 0.5, 0.1> scale 20 } finish { reflection 0.5 } }
torus { 40, 8 rotate 70 * x translate <50, 45, 60> pigment { rgb <1, 0.1, 0.1> } }
plane { y, 0 pigment { checker rgb 1 rgb 0.2 scale 50 } }
light_source { <200, 400, -300>, rgb 2 }

// Red resolves distances of about 300 units, and green resolves distances far beyond.
Lippmann_Depth_Fog(1, 300, 15000)

camera { location <0, 80, -260> look_at <0, 40, 0> right x * 4 / 3 angle 40 }
