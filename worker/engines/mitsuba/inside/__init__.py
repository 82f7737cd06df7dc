"""The program in the sandbox; the only place that imports Mitsuba, Dr.Jit and trimesh.

messages   the lines that a worker and the program exchange
probe      the program that tries a variant
"""
