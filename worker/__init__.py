"""Turns a planned job into pictures and video.

The quiet half is pure, without input or output; the service may import it:

job        what was asked for, and the words service and worker share
plan       a job's tasks, tiles, artifact names and cost
optics     what light does, in millimetres
integral   what integral images are, in pixels

The loud half has one folder for each outside thing:

povray     POV-Ray: the scene's text, the command line, the child process, its sandbox and what its answers mean
images     OpenImageIO
video      PyAV
exports    files in the formats of print shops and of research
store      artifacts
report     leases and events on Redis
whole_file files that are written whole or not at all
settings   what the environment says
app        Celery
tasks      decode, call, report
"""
