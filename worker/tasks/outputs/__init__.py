"""Outputs: makers that turn the masters of a job into what the job asks for.

registry       which maker makes which kind; makes one output with its sidecar
source        what outputs are made of: frames, lenses, orthoscopic sheets
context         what a maker receives: scratch folder, where files go, progress
sidecar        the JSON file that describes an output
videos         videos of views and of sheets; pictures into the file of a video
clips          videos with a motion of their own: of the eye, of the focus
observer       what an eye sees of the display
stereo         videos for two eyes
depth          the depth map of a view
pictures       still pictures of every frame, and contact sheets
prints         pages for a printer with marks, and calibration sheets
spoc           sheets for another display
datasets       folders and arrays of views
lenslet_video  raw sequences with a calibration file
frame_views    the views of one frame

A new kind of output is one module in `lippmann.job.outputs` with its options and one module here with its maker, each
registered by a decorator. The same makers work on the farm (`worker.tasks.encode`) and for `lippmann export`.
"""
