// The axes of a rig, placed in a scene that is made in metres: red points to the right, green upward, and blue along
// the optical axis to the observer. Each bar is 100 mm long.
//
//   povray +Istage.pov +L../.. +W320 +H240
//
// Licence: MIT. Run the command in this folder.

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

// The rig is 0.2 m above the floor and looks at the ball, so the blue bar points away from the ball. One unit of the
// scene is 1 m, which is 1000 mm.
object { Axes Lippmann_Stage(<-0.1, 0.2, -0.1>, <0.4, 0.05, 0.5>, y, 1000) }

sphere { <0.4, 0.05, 0.5>, 0.05 pigment { rgb <0.8, 0.6, 0.2> } }
plane { y, 0 pigment { checker rgb 0.9 rgb 0.6 scale 0.1 } }
light_source { <-1, 3, -2>, 1 }
background { rgb <0.6, 0.7, 0.9> }
camera { location <-0.25, 0.45, -0.7> look_at <0.1, 0.12, 0.1> angle 45 }
