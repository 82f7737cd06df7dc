"""Integral images in pixels: pure NumPy, no input or output. In the order of the pipeline.

layout        which pixel lies under which lens: the sheet and its cells
assemble      tiles become the whole sheet, every lens covered once
orthoscopic   the pseudoscopic capture becomes the orthoscopic integral image
views         one pixel per lens: views, the grid of all of them and back, their order in a movie

A sheet is an integral image as `(rows, cols, channel)`; row 0 is the top and col 0 the left, as the observer of the
display sees them. Its cells are `(lens_row, lens_col, row, col, channel)`.
"""
