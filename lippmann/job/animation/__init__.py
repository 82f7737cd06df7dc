"""The time of a job.

frames           frame ranges: the text `1-48:2, 60` and its frame numbers
clock            the clock of a scene, and the other variables that POV-Ray gives the frames of an animation
keyframes        numbers that change from frame to frame
"""
