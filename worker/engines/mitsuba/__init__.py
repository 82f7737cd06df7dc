"""Mitsuba: meshes, glTF and splats, traced by a program in the sandbox that stays for the tasks of one job.

session       the warm program of a slot: one job of one owner
answers       its answer to one request
render        a region: the request, the answer and the checked files
diagnosis     what the end of a request means for the attempt
surroundings  what the program finds around it: environment, folders and devices
version       the installed version and the variant that works
inside        the program in the sandbox; the only place that imports Mitsuba
"""
