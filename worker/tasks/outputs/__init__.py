"""Outputs: a job's masters made into what was asked for, one file of makers for each group of kinds.

footage    what outputs are made of: frames, lenses, orthoscopic sheets
making     one output being made: scratch folder, where files go, progress
make       the table: which maker makes which kind; the sidecar
sidecar    what is told beside an output, as JSON
videos     moving pictures
observer   what an eye sees of the display
clips      videos with a motion of their own: of the eye, of the focus
stereo     videos for two eyes
encoding   pictures into the one file of a video
depth      how deep what a view shows lies
pictures   still pictures of every frame
contact_sheet  small pictures side by side, one sheet for the job
prints     pages for a printer, with marks
spoc       sheets for another display
calibration  sheets that find an array's pitch
paper      pages as pictures
datasets   folders and arrays of views
lenslet_video  raw sequences with a calibration file
frame_views    the views of one frame

The same makers work on the farm (`worker.tasks.encode`) and for `lippmann export`.
"""
