// A sheet of 12 x 12 microlenses before a letter: every lens shows its own small picture of it, turned by 180 degrees.
//
//   povray +Ilens_array.pov +L.. +W320 +H320
//
// Units: mm.

#version 3.7;
global_settings { assumed_gamma 1 max_trace_level 10 }

#include "lippmann/glass.inc"
#include "lippmann/lens_array.inc"

#declare Pitch = 1;
#declare Focal_Length = 3.3;
#declare Index = 1.49;
#declare Radius = (Index - 1) * Focal_Length;
#declare Rim = Pitch / sqrt(2); // through the corners: no gaps between the lenses

object {
  Lippmann_Lens_Array_Square(12, 12, Pitch, Radius, sqrt(Radius * Radius - Rim * Rim), Index)
}

// The observer looks along -z; the letter lies 200 mm behind the flat side.
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
