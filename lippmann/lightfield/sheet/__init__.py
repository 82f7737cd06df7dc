"""The sheet of an integral image, in the order of the pipeline.

cells           the sheet cut into cells, and back
supersample     a rendering with k x k times the pixels, averaged inside the cells
assemble        tiles put together into the sheet
bands           sheets larger than memory, in bands of lens rows
orthoscopic     the half-turn of the elemental images, which makes a pseudoscopic capture orthoscopic
pinholes        arrays of pinholes in front of pixels
spoc            SPOC: the conversion for a display of another pitch, count, gap, lattice and distance
device          the sheet resampled to the pixel grid of a device, cell by cell
lens_grid       lenses over a picture whose pitch is not a whole number of pixels
cell_sampling   light at any place under a lens, from its own cell alone
rectify         a picture of such lenses resampled to whole cells: the inverse of `device`
interpolation   linear interpolation between neighbouring pixels
"""
