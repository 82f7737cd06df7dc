// Where a rig stands: its axes as bars of 100 mm, red to the right, green upward, blue along the optical axis, at a
// place in a scene that is made in metres.
//
//   povray +Istage.pov +L.. +W320 +H240

#version 3.7;
global_settings { assumed_gamma 1 }

#include "lippmann/stage.inc"

#macro Bar(Axis, Colour)
  cylinder { 0, 100 * Axis, 6 pigment { Colour } }
#end

#declare Axes = union {
  Bar(x, rgb <0.9, 0.1, 0.1>)
  Bar(y, rgb <0.1, 0.7, 0.1>)
  Bar(z, rgb <0.1, 0.2, 0.9>)
  sphere { 0, 10 pigment { rgb 0.9 } }
};

// Half a metre above the floor, looking at the ball: the blue bar points away from it. 1 unit = 1 m = 1000 mm.
object { Axes Lippmann_Stage(<-0.1, 0.2, -0.1>, <0.4, 0.05, 0.5>, y, 1000) }

sphere { <0.4, 0.05, 0.5>, 0.05 pigment { rgb <0.8, 0.6, 0.2> } }
plane { y, 0 pigment { checker rgb 0.9 rgb 0.6 scale 0.1 } }
light_source { <-1, 3, -2>, 1 }
background { rgb <0.6, 0.7, 0.9> }
camera { location <-0.25, 0.45, -0.7> look_at <0.1, 0.12, 0.1> angle 45 }
