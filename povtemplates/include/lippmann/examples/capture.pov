// A whole integral image by plain POV-Ray: the imaging lens of Athineos et al. (2006) and 30 x 30 microlenses, with 8
// pixels for each lens.
//
//   povray +Icapture.pov +L../.. +W240 +H240
//
// Licence: MIT. Run the command in this folder. Units: mm.
//
// The sides of the picture are the number of lenses times the pixels of a lens. Antialiasing is off, because
// neighbouring pixels can belong to different lenses.

#version 3.7;

#include "lippmann/stage.inc"
#include "lippmann/imaging_lens.inc"
#include "lippmann/lens_array.inc"
#include "lippmann/capture.inc"

// The scene is 1000 to 2500 mm before the first surface. A ray meets 2 surfaces of the array and 6 of the imaging lens
// before it meets the scene, so max_trace_level is more than POV-Ray's default of 5.
global_settings { assumed_gamma 1 max_trace_level 24 }
sphere { <20, 70, 0>, 45 pigment { rgb <0.9, 0.5, 0.1> } finish { phong 0.8 } }
cylinder { <-60, 0, 500>, <-60, 400, 500>, 20 pigment { rgb <0.2, 0.6, 0.2> } }
plane { y, 0 pigment { checker rgb 0.9 rgb 0.4 scale 40 } }
light_source { <-500, 1500, -1000>, 1 }
background { rgb <0.5, 0.7, 1> }

// The place of the rig: its first surface, the point that it looks at, the upward direction and the millimetres in a
// unit.
#macro Stand()
  Lippmann_Stage(<0, 60, -1000>, <0, 60, 0>, y, 1)
#end

// The microlens array.
#declare Rows = 30;
#declare Columns = 30;
#declare Pitch = 1;
#declare Focal_Length = 3.3;
#declare Index = 1.49;

// The imaging lens, by Table 1 of the paper: radius, thickness, index behind, semi-aperture.
#declare Surfaces = array[6][4] {
  {    0,     84.28, 1.51, 100 },
  { -242.38, 289.3,  1,    100 },
  {    0,     17.16, 1.5,  100 },
  { -300,      0.001, 1,   100 },
  {  300,     17.16, 1.5,  100 },
  {    0,      0,    1,    100 }
};

// The ball is 1000 mm from the lens. The array stands 40 mm before the image of the ball.
#declare Array_Z = Lippmann_Image_Z(Surfaces, 1000) - 40;

object { Lippmann_Imaging_Lens(Surfaces) Stand() }
object {
  Lippmann_Microlens_Array_Square(Rows, Columns, Pitch, Focal_Length, Index, 0)
  translate Array_Z * z
  Stand()
}
camera { Lippmann_Camera_Square(Rows, Columns, Pitch, Array_Z) Stand() }
