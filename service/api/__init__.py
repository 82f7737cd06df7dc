"""The answers of the HTTP API.

presenters      jobs and tasks from rows
waits           why jobs and tasks wait
listings        pages of jobs, tasks and frames
artifact_files  the files of a job, ranges, and logs
output_archive  all files of an output in one zip
design          the design of a job file
"""
