"""From a job to its tasks: pure, no input or output.

names      the names of artifacts
sampling   where mm meet px: frame size, tiles along lens edges
cost       how long a frame takes, and how finely it is cut
tasks      every task, its stage and what it needs
"""
