"""Pictures as files: OpenImageIO, and only here.

read       EXR and PNG to arrays, whole or a region, every read checked
foreign    PNG, TIFF and EXR of other programs to linear light
write      linear EXR masters; sRGB PNG and WebP for people
rows       pictures that need not fit in memory: rows in, rows out
scratch    pixels on disk as plain numbers
views      all views of a sheet that need not fit in memory
colour     linear light to sRGB codes
false_colour  depth as colours
resize     another size, by a named filter
tiff       TIFF by bands of rows
png        PNG by bands of rows, and the rows of a PDF
drawing    black shapes on paper
turned     a picture in bands, turned by quarters
density    pixels an inch
icc        sRGB as a profile
lettering  words in pictures
encode     pixels to a file that lives in memory, and from there to disk
convert    a linear EXR, or light, as bytes of a file, for the service
codes      a picture of either kind as 8-bit sRGB codes, for comparing
threads    how many threads OpenImageIO takes

Arrays are `(rows, cols, channel)`, row 0 at the top, with the three channels red, green and blue; numbers that are not
light have channels of their own names.

Importing this package is safe anywhere. *Using* it starts OpenImageIO's threads, and a child forked after that hangs at
its first picture: use it only in processes that do not fork workers later on (Celery's parent does). From threads of
one process it may be used freely.

Nothing here is atomic: write beside, then hand the file to the store.
"""
