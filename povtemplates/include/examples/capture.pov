// A whole integral image by plain POV-Ray: the paper's imaging lens and 30 x 30 microlenses, 8 pixels a lens.
//
//   povray +Icapture.pov +L.. +W240 +H240
//
// Units: mm. The picture's sides are the number of lenses times the pixels of a lens; without antialiasing, because a
// pixel's neighbours may belong to another lens.

#version 3.7;

#include "lippmann/stage.inc"
#include "lippmann/glass.inc"
#include "lippmann/imaging_lens.inc"
#include "lippmann/lens_array.inc"
#include "lippmann/capture.inc"

// The scene, 1000 to 2500 mm before the first surface. 8 surfaces and the scene's own: raise max_trace_level.
global_settings { assumed_gamma 1 max_trace_level 24 }
sphere { <20, 70, 0>, 45 pigment { rgb <0.9, 0.5, 0.1> } finish { phong 0.8 } }
cylinder { <-60, 0, 500>, <-60, 400, 500>, 20 pigment { rgb <0.2, 0.6, 0.2> } }
plane { y, 0 pigment { checker rgb 0.9 rgb 0.4 scale 40 } }
light_source { <-500, 1500, -1000>, 1 }
background { rgb <0.5, 0.7, 1> }

// Where the rig stands: its first surface, what it looks at, what is up, millimetres in a unit.
#macro Stand()
  Lippmann_Stage(<0, 60, -1000>, <0, 60, 0>, y, 1)
#end

// Table 1 of Athineos et al. (2006): radius, thickness, index behind, semi-aperture.
#declare Surfaces = array[6][4] {
  {    0,     84.28, 1.51, 100 },
  { -242.38, 289.3,  1,    100 },
  {    0,     17.16, 1.5,  100 },
  { -300,      0.001, 1,   100 },
  {  300,     17.16, 1.5,  100 },
  {    0,      0,    1,    100 }
};

// The ball's image lies 592.24 mm behind the first surface; 40 mm before it stands the array: it is shown real.
#declare Array_Z = 552.24;

object { Lippmann_Imaging_Lens(Surfaces) Stand() }
object { Lippmann_Lens_Array_Square(30, 30, 1, 1.617, 1.454197, 1.49) translate Array_Z * z Stand() }
camera { Lippmann_Orthographic(30, 30, Array_Z, 20) Stand() }
