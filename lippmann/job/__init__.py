"""Jobs: what a client asks for, and what service and workers exchange about it. Pure: no input or output.

frames           frame ranges: the text `1-48:2, 60` and its frame numbers
json_types       values keep the types of JSON
keyframes        numbers that change from frame to frame
glasses          optical materials by name: refractive index and Abbe number
lens             imaging lenses: prescriptions, surface by surface
rig              the rig: imaging lens, microlens array, camera and device
presets          microlens arrays and whole jobs by name
render_settings  the capture method, antialiasing, tiles and limits of a render
stage            the position of the rig in a scene, and the scale
scene            scenes: stage, clock and parameters
imported_sheets  bundles of imported integral images, in place of a scene
viewing          terms and defaults for viewing a display: eyes, gaps, stereo pairs, resampling filters
outputs/         the outputs of a job: one module for each group of kinds
spec             the job specification, and `parse_spec`, which validates it
resolved         a job resolved against its scene, as it is stored for workers
later_fields     fields that an earlier release does not know, left out of what is stored while unused
old_names        former names of fields and settings that are still accepted
problems         validation errors, field by field
states           statuses of jobs, tasks and frames, the transitions between them, and users' actions
messages/        messages between the service and the workers: orders, events and the names on Redis
"""
