"""The tasks of a worker: decode an order, call, report.

entry       the four Celery tasks, by name
probe       the first frame at low resolution: whether the scene parses, and the seconds per pixel
encode      frames to one output
local       one frame, or a job, without a farm
attempts/   one attempt: lease, work, report; its monitor, log, artifacts and scratch folder
scenes/     the scene of a task: its files and its own camera
frames/     tiles rendered, or taken from the render cache, and assembled
outputs/    the makers of all kinds of output
previews/   the live preview of a rig
"""
