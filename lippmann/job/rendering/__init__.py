"""The rendering of a job: the capture method, channels, engines, and the workers that may do it.

render_settings  the capture method, antialiasing, tiles and limits of a render
channels         the channels that are stored beside the colours and the depth
engines          the engines: which one a scene needs, and what each of them cannot do
workers          the workers that may do the tasks: pool, tags, memory and engine
"""
