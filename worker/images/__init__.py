"""Pictures as files; OpenImageIO is used only here.

read          EXR and PNG to arrays, with every read checked; OpenImageIO's threads
header        the headers of pictures of other programs, read by content and bounded
headers       the headers of single formats
notes         what the user should know of such pictures
upright       a picture turned as its orientation tag says
decoder       the program that decodes one picture inside the sandbox
colour_space  what the codes of such pictures mean
write         linear EXR masters; sRGB PNG and WebP for people
encode        pixels to a file in memory, and from there to disk
rows          pictures that need not fit in memory: bands of rows in and out
scratch       pixels in a temporary file as plain numbers
rearrange     pictures in bands, rearranged: turned by quarters, all views of a sheet
png           PNG by bands of rows; the rows of a PDF
tiff          TIFF by bands of rows
density       pixels per inch as files store it
colour        linear light to sRGB codes and back; depth as colours
icc           ICC profiles: the one of sRGB, and the curves of others
resize        another size, by a named filter
drawing       black shapes and words in pictures
convert       a linear EXR as the bytes of another file

Arrays are `(rows, cols, channel)`, row 0 at the top, with the three channels red, green and blue; numbers that are not
light have channels with their own names.

Importing this package is safe anywhere. *Using* it starts OpenImageIO's threads, and a child process forked after that
hangs at its first picture: use it only in processes that do not fork workers later (Celery's parent does). Threads of
one process may use it freely.

Nothing here is atomic: write a file under a temporary name, then hand it to the store.
"""
