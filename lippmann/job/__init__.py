"""Jobs: what a client asks for, and what service and workers exchange about it. Pure: no input or output.

spec        the job specification, and `parse_spec`, which validates it
resolved    a job resolved against its scene, as it is stored for workers
states      statuses of jobs, tasks and frames, the transitions between them, and users' actions
presets     microlens arrays and whole jobs by name
fields/     how fields are read: types, names, labels and errors
optics/     the rig: imaging lens, microlens array, camera and device
animation/  frame ranges, the clock of a scene and keyframes
scenes/     scenes: stage, clock, parameters and camera; bundles of imported integral images
rendering/  the capture method, channels, engines, and the workers that may do the tasks
outputs/    the outputs of a job: one module for each group of kinds
messages/   messages between the service and the workers: orders, events and the names on Redis
"""
