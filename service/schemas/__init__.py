"""The schemas of the API.

answer     the base of all answers, and times
job        a job, its outputs and its size
task       a task of a job
wait       why a job or a task waits
frame      a frame of a job
events     the events of the stream
viewing    views of a frame on demand, and the queries for them
artifact   a file of a job
scene      a scene that jobs can use
design     the design of a job file
farm       health and workers
access     keys and login links
problem    errors
links      the paths of the API
"""
