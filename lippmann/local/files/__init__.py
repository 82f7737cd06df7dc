"""Files that the local commands read and write.

master           masters, and what their headers name
image_files      integral images and pictures written
open_master      the master that a command works on
job_masters      masters of a job, fetched
frame_source     masters as the frames that outputs are made from
job              job files, and `--set`
bundle           scene bundles
lens             imaging lenses
displayed_image  the pixels and the lenses of a display, from a master
picture_size     the size of a written picture
source_pictures  pictures of other programs as frames
view_files       views of other programs: quilts and folders
writable         whether a folder can be written
"""
