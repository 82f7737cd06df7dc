"""Decode, call, report.

entry       the four Celery tasks, by name
attempt     one attempt: lease, work, report
logs        a log for every attempt
monitor       how work tells its progress and hears that it should stop
workplace   where a worker works: store, scratch folders, POV-Ray and its sandbox
picture     one POV-Ray picture of a job, whole or a tile of it
depth_pass  how deep what every pixel of a tile shows lies, by a second picture
probe       the first frame, small: does the scene parse, and what does a pixel cost
render      a tile into the store
foreign     the sheet of a frame that is not rendered, from the job's bundle
assemble    tiles -> integral image -> orthoscopic -> views -> thumbnail
masters     what assemble stores, held in memory or read back from disk
encode      frames into videos
outputs     what a job asks for beside its masters, a maker for each kind
local       one frame, or a job, without a farm
"""
