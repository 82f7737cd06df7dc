"""Previews: one small frame of a job at once, by a process of the worker beside its slots.

camera   the stage of a preview: the scene's own camera says its handedness, and may carry the rig
picture  the pixels and the two pictures of them
serve    the process: takes orders, one at a time, and answers
local    the same without a farm
"""
