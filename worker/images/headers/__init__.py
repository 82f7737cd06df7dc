"""Readers of the headers of single formats, for `worker.images.foreign.header`.

picture     what a header says, and its limits
tiff        the directories of TIFF, which EXIF is too
jpeg        the segments of JPEG, and its quality
"""
