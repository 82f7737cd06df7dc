"""Moving pictures as files: PyAV (FFmpeg), and only here.

size       how far a small view is enlarged for a screen, and even sizes
kinds      codecs and containers, and how they are set: one table
encode     frames to a file, one at a time
read       frames of a file, one at a time

Frames are `(rows, cols, 3)`, row 0 at the top, sRGB codes of red, green and blue.
"""
