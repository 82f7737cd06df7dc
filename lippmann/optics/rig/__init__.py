"""The capture geometry: bench, microlens array, camera, display and the exact rays of every pixel.

array        the microlens array in the rig frame, and the window that shows it
microlens    one microlens: radius, displacement, thickness
bench        the positions of imaging lens, array and camera, and the ray of every pixel
pixel_rays   the rays of a whole picture
bands        the wavelength bands of a dispersing rig
colour_matching   the share of a wavelength in each colour channel
method       the capture method: refractive geometry or ray camera
check        checks of a job's optics, and notes on them
disparity    the shift of a point from one view to the next
parallax     the same for the point that each pixel shows
sharp_depth  the depth at which a refocused picture shows a point sharpest
spots        the image of a point, by the exact trace
display      the array on the display: gaps, depths, viewing angle
to_scene     the place of the rig in its scene, as a matrix
"""
