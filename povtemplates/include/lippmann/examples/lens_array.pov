// A sheet of 12 x 12 microlenses before a letter. Every lens shows its own small picture of the letter, turned by 180
// degrees.
//
//   povray +Ilens_array.pov +L../.. +W320 +H320
//
// Licence: MIT. Run the command in this folder. Units: mm.

#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 10 }

#include "lippmann/lens_array.inc"

// 12 rows and 12 columns, pitch 1 mm, focal length 3.3 mm, index 1.49. With an aperture of 0 the lenses fill their
// cells.
object { Lippmann_Microlens_Array_Square(12, 12, 1, 3.3, 1.49, 0) }

// The observer looks along -z. The letter is 200 mm behind the flat side of the array.
union {
  box { <-20, -25, 0>, <-10, 25, 1> }
  box { <-20, 15, 0>, <20, 25, 1> }
  box { <-20, -5, 0>, <10, 5, 1> }
  translate -200 * z
  pigment { rgb <0.1, 0.3, 0.7> }
  finish { ambient 0 diffuse 0 emission 1 }
}

background { rgb <0.9, 0.9, 0.8> }
camera { orthographic location 50 * z direction -z right 12.5 * x up 12.5 * y }
