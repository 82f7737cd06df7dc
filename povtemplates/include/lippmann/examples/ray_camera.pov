// An integral image by ideal lenses, without glass: the ray of every pixel passes through the centre of its microlens.
// There are 30 x 30 lenses with 8 x 8 pixels each, and no imaging lens.
//
//   povray +Iray_camera.pov +L../.. +W240 +H241 +SR2 +ER241
//
// Licence: MIT. Run the command in this folder. Units: mm. The first row of the picture stays black: see
// ray_camera.inc.

#version 3.7;
global_settings { assumed_gamma 1 }

#include "lippmann/ray_camera.inc"

#declare Lenses = 30;
#declare Pixels = 8;
#declare Pitch = 1;
#declare Focal_Length = 3.3;

// The rays in the axes of the rig, whose array of lenses is the plane z = 0. The pixels are Focal_Length behind it.
#declare Rays = mesh2 {
  vertex_vectors {
    3 * pow(Lenses * Pixels, 2)
    #declare Row = 0;
    #while (Row < Lenses * Pixels)
      #declare Column = 0;
      #while (Column < Lenses * Pixels)
        #declare Centre = <floor(Column / Pixels) + 0.5, -floor(Row / Pixels) - 0.5, 0>;
        #declare Centre = (Centre + <-Lenses, Lenses, 0> / 2) * Pitch;
        #declare Pixel = (<(Column + 0.5) / Pixels, -(Row + 0.5) / Pixels, 0> + <-Lenses, Lenses, 0> / 2) * Pitch;
        , Lippmann_Ray(Centre, Centre - (Pixel + Focal_Length * z))
        #declare Column = Column + 1;
      #end
      #declare Row = Row + 1;
    #end
  }
  face_indices {
    pow(Lenses * Pixels, 2)
    #declare Face = 0;
    #while (Face < pow(Lenses * Pixels, 2))
      , <3 * Face, 3 * Face + 1, 3 * Face + 2>
      #declare Face = Face + 1;
    #end
  }
};

camera { Lippmann_Ray_Camera(Rays, <0, 20, -60>, <0, 20, 0>, y, 1) }

sphere { <3, 22, 0>, 8 pigment { rgb <0.9, 0.5, 0.1> } finish { phong 0.8 } }
cylinder { <-8, 0, 60>, <-8, 80, 60>, 3 pigment { rgb <0.2, 0.6, 0.2> } }
plane { y, 0 pigment { checker rgb 0.9 rgb 0.4 scale 10 } }
light_source { <-100, 300, -200>, 1 }
background { rgb <0.5, 0.7, 1> }
