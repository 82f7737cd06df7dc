"""What light does, in millimetres: pure functions on arrays, no input or output.

frame          the rig frame (this docstring, below)
prescription   imaging lenses as tables of surfaces; the published ones by name
matrices       ray-transfer matrices, cardinal points, conjugates (paraxial)
trace          the exact trace of skew rays through spherical and plane surfaces
microlens      one lens of the array: radius, displacement, thickness
lattice        where the lenses of an array stand
capture        the bench put together: where everything stands, and the ray of every pixel
check          whether a job's optics can be, and what its maker should know

The rig frame: z is the optical axis and grows from the scene through the imaging lens and the microlens array (MLA) to
the camera; the vertex of surface 1 of the imaging lens is the origin. Seen by the observer behind the display, who
looks toward -z, x grows to the right and y grows upward (a right-handed frame). `s_mm` is the signed distance of a
point of the scene's image from the MLA plane, positive toward the camera and the observer.
"""
