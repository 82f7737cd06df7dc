// A preview of the fish scene for plain POV-Ray. The camera is a pinhole at the front focal point of the lens, 56.56 mm
// behind its first surface. The rays of the middle pixels of all microlenses pass through this point. The option +K
// gives the clock in frames.
// Licence: MIT.
//
//   povray +Ipreview.pov +W720 +H720 +K4 +A0.1

#version 3.7;

#include "scene.inc"

camera {
  perspective
  location <0, 60, -1056.56>
  direction z
  up y
  right x
  angle 17.04
  look_at <0, 60, 0>
}
