"""Previews of jobs: rendered at once by a worker, and stored nowhere.

prepare  a job file becomes the job of a preview
choose   the worker that renders it
broker   the orders, the answers, and which preview of a series is the newest, over Redis
series   the previews of this process that are waited for: the newest of each series, and a few of each key
run      one preview from its order to its answer
"""
