"""Integral images in pixels: NumPy arrays in, NumPy arrays out, no input or output.

image       the integral image: pixels, lenses, pitch and focal length, orthoscopic or pseudoscopic
sheet       the sheet of pixels: cells, assembly, orthoscopic conversion, SPOC, resampling to a device and back
views       views (sub-aperture views), epipolar images, perspectives and atlases
refocus     shift-and-sum, CIIR, depth-focused views, all-in-focus pictures
depth       depth maps: ground truth, estimates and their errors
observer    the virtual observer: what an eye sees of a print or panel under its lenses
quality     PSNR, SSIM, luminance and rate-distortion
calibrate   the lenses over a picture from elsewhere

A sheet is an integral image as `(rows, cols, channel)`; row 0 is the top and col 0 the left, as the observer of the
display sees them. Its cells are `(lens_row, lens_col, cell_row, cell_col, channel)`. Functions that need no millimetres
take a sheet and its layout; functions of an orthoscopic image take an `IntegralImage` and refuse a pseudoscopic one.
"""
