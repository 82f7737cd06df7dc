"""The outputs that a job may ask for beside its masters: one model with its options for each kind of output.

output      the base of all kinds, and the registry of the kinds
choice      all kinds as one field of a job, and their short spelling: `views.mp4`
videos      videos of views and of sheets
clips       videos with a motion of their own: of the eye, of the focus
observer    what an eye sees of the display, as a clip and as pictures
stereo      videos for two eyes
codecs      the codecs, and what may be chosen about each
depth       the depth map of a view
pictures    still pictures of every frame, and contact sheets
prints      pages for a printer, and calibration sheets
spoc        sheets for another display
datasets    folders and arrays for research on coding and depth
view_block  a block of views about the middle view
"""
