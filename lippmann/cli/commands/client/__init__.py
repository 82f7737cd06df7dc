"""The commands of those who use a farm.

jobs           submit, jobs, show, tasks, logs, watch
job_actions    cancel, pause, resume, retry, repair, skip, priority, rm
files          fetch, link
scenes         scenes list, show, upload, rm; capture
"""
