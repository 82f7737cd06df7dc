"""Integral images in pixels: pure NumPy, no input or output. In the order of the pipeline.

layout            which pixel lies under which lens, on the square and the hexagonal lattice
hexagon           a hexagonal lens in pixels
cells             the sheet into cells and back
supersample       a rendering with k x k times the pixels becomes the sheet, averaged inside the cells
assemble          tiles become the whole sheet, every lens covered once
orthoscopic       the pseudoscopic capture becomes the orthoscopic integral image
pinholes          arrays of pinholes before pixels: where they stand, which one is nearest
spoc              the same for a display of another pitch, count, gap, lattice and place
views             one pixel per lens: views, the grid of all of them and back, their order in a movie
bands             sheets larger than memory, in bands of lens rows
between_views     a row of views in another number
epi               epipolar slices: a line of lenses as the eye moves along it
mosaic            pictures of one size put together into one
perspective       what an eye at a place sees
reach             how far an eye may move so that all lenses show their own light
atlas             views in one picture for a graphics card
lens_display      a display in millimetres: pixels, gap, lenses
observer          what an eye sees of it, with a pupil, device pixels and crosstalk
window            the part of the display that it looks at, in pixels
eye_rays          rays through the pupil
moving_eye        the places of an eye that moves
stereo            two eyes, and their pictures as one
looking           with one eye or two: one picture
light_field       all views in one array
square_pixels     views of a hexagonal lattice on the square pixels of a screen
refocus           sharp at one depth or at many: the views shifted and added
ciir              the same by cells magnified and laid over each other, with as many pixels as one likes
depth_view        a view of a patch of every cell, that joins up at one depth
extended_focus    sharp at all depths of a stack
weighted_sums     pictures as weighted sums of a sheet's pixels, down and across: what both of these are
plane_sweep       depth from the pictures: where a view fits the others
structure_tensor  depth from the pictures: slopes of lines in epipolar images
view_depth        the depth of a view, known or estimated
depth_errors      how wrong an estimate is
depth_map         how deep what every pixel of a sheet shows lies
device            the integral image on the pixel grid of a device, resampled cell by cell
lens_grid         where lenses lie on pixels that their pitch is no whole number of
under_lenses      light at any place under a lens, of its own cell alone
whole_cells       a sheet of such a pitch, a print or a scan, made into whole cells: the way back from `device`
finding           where the lenses of a picture from elsewhere are
foreign           such a picture made into the sheet that the rest takes
interpolation     between neighbours, linear
half_floats       half floats in single precision, quickly
luminance         how bright light of three colours is
compare           PSNR and SSIM of two sheets and of every view
rate_distortion   how much a codec saves against another

A sheet is an integral image as `(rows, cols, channel)`; row 0 is the top and col 0 the left, as the observer of the
display sees them. Its cells are `(lens_row, lens_col, cell_row, cell_col, channel)`.
"""
