"""Where artifacts lie. Names are POSIX paths without a leading slash; there means whole.

protocol   what a store does
names      which names an artifact may have
local      a folder on this machine, or on a disk that all machines share
"""
