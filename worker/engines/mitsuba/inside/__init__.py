"""The program in the sandbox; the only place that imports Mitsuba, Dr.Jit and trimesh.

messages   the lines that a worker and the program exchange
program    the loop that answers requests and keeps the scene
shade      a region of a picture, in bands of rows
arrays     the operations of Dr.Jit with which the exact trace runs
rays       the rays of the samples of pixels, in the units of a scene
whitted    light without noise, by one ray of a pixel
path       light by paths, for several samples of a pixel
channels   distance, position, normal, albedo and object
probe      the program that tries a variant
"""
