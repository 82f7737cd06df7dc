"""HTTP only: parse, call jobs, shape the answer.

health     how the farm is; who works
scenes     scenes that jobs can ask for
design     what a job will give
jobs       submit, list, show, move, remove
tasks      tasks and their logs; frames
looks      what can be seen of a frame
artifacts  files, whole and in part
events     what happens, as it happens
workers    who is there
keys       keys and login links
login      browsers come in and go out
middleware names of requests, and a limit to their size
problems   every error becomes a problem
"""
