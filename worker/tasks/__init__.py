"""The tasks of a worker: decode an order, call, report.

entry       the four Celery tasks, by name
artifacts   what an attempt reads, verified, and what it stores, with digests
attempt     one attempt: acquire the lease, work, report
monitor     progress monitors
workplace   store, scratch folders, sandbox, the log of an attempt
probe       the first frame at low resolution: whether the scene parses, and the seconds per pixel
render      a tile into the store
render_cache    a tile that was rendered before
picture     one POV-Ray picture of a job, the whole or a tile
depth_pass  the depth of the pixels of a tile, by a second picture
imported    the image of a frame that is not rendered, from the bundle of the job
assemble    tiles to integral image, orthoscopic image, views and thumbnail
masters     the masters that assemble stores, in memory or read again from disk
encode      frames to one output
outputs/    the makers of all kinds of output
local       one frame, or a job, without a farm
"""
