"""Pictures as files; OpenImageIO is used only here.

read             EXR and PNG to arrays, with every read checked; OpenImageIO's threads
write            linear EXR masters; sRGB PNG and WebP for people
encode           pixels to a file in memory, and from there to disk
convert          a linear EXR as the bytes of another file
density          pixels per inch as files store it
colour           linear light to sRGB codes and back; depth as colours
channel_colours  the colours in which people are shown channels that are no light
icc              ICC profiles: the one of sRGB, and the curves of others
resize           another size, by a named filter
drawing          black shapes and words in pictures
foreign/         pictures of other programs: headers, decoder, colour spaces, orientation
headers/         the headers of single formats
bands/           pictures that need not fit in memory

Arrays are `(rows, cols, channel)`, row 0 at the top, with the three channels red, green and blue; numbers that are not
light have channels with their own names.

Importing this package is safe anywhere. *Using* it starts OpenImageIO's threads, and a child process forked after that
hangs at its first picture: use it only in processes that do not fork workers later (Celery's parent does). Threads of
one process may use it freely.

Nothing here is atomic: write a file under a temporary name, then hand it to the store.
"""
