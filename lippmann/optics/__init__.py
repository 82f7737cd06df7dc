"""What light does, in millimetres: pure functions on arrays, no input or output.

frame          the rig frame (this docstring, below)
surfaces       what an imaging lens is: surfaces, media, a stop
asphere        the sag of conics and even polynomials, and where rays meet it
lenses         the published ones
lens_csv       prescriptions in tables
lens_zmx       prescriptions in Zemax files
lens_rows      rows that both read, into a prescription
prescription   the imaging lens of a rig: found, scaled, checked, its stop set
matrices       ray-transfer matrices, cardinal points, conjugates (paraxial)
stop           where a stop stands and how wide its hole is for an f-number
lens_check     whether a lens can be built and lets light through
dispersion     an Abbe number as POV-Ray takes it
trace          the exact trace of skew rays through imaging lenses
field_spots    the spots of distant points, by the exact trace: how sharp a lens is
spots          the picture of a point, by the exact trace
microlens      one lens of the array: radius, displacement, thickness
lattice        where the lenses of an array stand, square or hexagonal, and the window that shows them
capture        the bench put together: where everything stands, and the ray of every pixel
pixel_rays     the rays of a whole picture
method         modelled glass or ray camera
check          whether a job's optics can be, and what its maker should know
disparity      how far a point moves from view to view
parallax       the same for what every pixel shows
display        the array on the display: gaps, depths, viewing angle
drawn_rays     the rays that a drawing shows
drawn_bench    the elements, as a drawing shows them
svg            panels, scale bars and labels of a drawing
diagram        the bench drawn to scale, as SVG

The rig frame: z is the optical axis and grows from the scene through the imaging lens and the microlens array (MLA) to
the camera; the vertex of surface 1 of the imaging lens is the origin. Seen by the observer behind the display, who
looks toward -z, x grows to the right and y grows upward (a right-handed frame). `s_mm` is the signed distance of a
point of the scene's image from the MLA plane, positive toward the camera and the observer.
"""
