"""The use cases, in the order of a job's life.

ids         names of jobs, tasks and attempts
scenes      scenes that come along, and scenes of users
submit      a job file becomes a job
design      what a job will give, before it is one
show        a job or task as the API says it
browse      pages of jobs, tasks and frames
frame_status   where a frame stands: pure
artifacts   files of a job
look        what can be seen of a frame, made when it is asked for
logs        the log of an attempt
bell        wakes the clerk and the listeners
tell        listeners are told, in the transaction that changes something
listen      what one listener hears
moves       the moves of a job
dispatch    ready tasks go out, best first
fairness    which job goes next: pure
follow      events become rows
hearing     since when no event was missed
failure     what a failed attempt means
release     attempts are told to stop
unblock     tasks whose needs are done become ready
plan        the probe's result becomes tasks
chores      work on rows in pieces
settle      a job ends when nothing is left, or nothing can go on
pause, cancel, retry, remove, prioritise   what users ask for
mend        what can no longer be read is made again, before a retry
reconcile   the rows are made right
sweep       what removed jobs left is taken away
lead        one clerk at a time
clerk       the threads that do all this
keys        keys, login links, sessions
health      how the farm is
"""
