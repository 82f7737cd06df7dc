"""Lens designs of Zemax (.zmx).

prescription  the lens in the text of a file
aspheres      the shape of a surface, with its term of r^2
system        the aperture and the field
lines         the lines of a file, surface by surface
"""
