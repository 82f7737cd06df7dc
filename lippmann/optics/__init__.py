"""Optics in millimetres: pure functions on arrays, without input or output.

lens/        imaging lenses: prescriptions, ray-transfer matrices and the exact trace
lens_files/  files of imaging lenses and of their glasses
rig/         the capture geometry: bench, microlens array, camera, display and the exact rays of every pixel
drawing/     drawings of the optical bench, to scale, as SVG

The rig frame: z is the optical axis and grows from the scene through the imaging lens and the microlens array (MLA) to
the camera; the vertex of surface 1 of the imaging lens is the origin. Seen by the observer behind the display, who
looks toward -z, x grows to the right and y grows upward (a right-handed frame). `s_mm` is the signed distance of a
point of the scene's image from the MLA plane, positive toward the camera and the observer.
"""
