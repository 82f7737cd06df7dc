"""What the API says.

answer     the form of every answer, and times
job        a job, its outputs and size
task       a task of a job
frame      a frame of a job
look       what can be seen of a frame
artifact   a file of a job
scene      a scene that jobs can ask for
design     what a job will give
farm       health and workers
access     keys and login links
problem    every error
"""
