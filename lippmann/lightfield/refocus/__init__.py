"""Refocusing an orthoscopic image.

shift_and_sum        the shifted views added up; one depth, or a focal stack
ciir                 computational integral imaging reconstruction: magnified cells, with any number of pixels a lens
depth_focused_view   a view with several pixels a lens that joins up at one depth
all_in_focus         a picture that is sharp at every depth of a focal stack
autofocus            the depth at which the picture is sharpest around a place
weighted_sums        pictures as weighted sums of the pixels of a sheet, which the first two compute
"""
