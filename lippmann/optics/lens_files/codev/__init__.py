"""Lens designs of CODE V: the plain subset of a sequence file (.seq).

prescription  the lens in the text of a file
surfaces      a surface
system        the aperture and the field
glasses       the private glasses
commands      the commands of a file
"""
