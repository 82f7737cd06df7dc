"""Mitsuba: meshes, glTF and splats, traced by a program in the sandbox that stays for the tasks of one job.

version       the installed version and the variant that works
inside        the program in the sandbox; the only place that imports Mitsuba
"""
