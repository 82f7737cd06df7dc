"""Depth maps of an orthoscopic image.

depth_map          the depth of every pixel of a sheet, as the capture stores it
view_depth         the depth of one view, known or estimated
structure_tensor   the estimate from the slopes of lines in epipolar images
plane_sweep        the estimate from the agreement of shifted views
errors             the errors of an estimate
"""
