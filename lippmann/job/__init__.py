"""What was asked for, and the words service and worker share. Pure: no input or output.

frames     `1-48:2, 60` and the numbers it stands for
glasses    materials by name: index and Abbe number
lens       an imaging lens, surface by surface
lens_array whole pixels under hexagons
presets    arrays and jobs by name
rig        imaging lens, microlens array, camera, device
sheet_geometry   where the lenses lie on integral images from elsewhere
stage      where the rig stands in a scene
render_settings  the road through the optics, samples, tiles, limits
keyframes  numbers that change with the frame
eyes       the words of whoever looks at a display
filters    how a picture is brought to another size, by name
outputs/   what a job asks for beside its masters, a module a group of kinds
tagged     fields with several forms
misfit     fields that do not go together
old_names  names that changed, which job files and the environment may still use
problems   what was found wrong, field by field
spec       the job as it was asked for, and the one door that checks it
foreign_sheets   a bundle of integral images from elsewhere, in place of a scene
scene      the scene as a job sees it: stage, clock, parameters
sheet      the job as it is stored for workers
statuses   jobs' and tasks' statuses and the moves between them
orders     what a worker is told
events     what a worker says
wire       the names both meet under on Redis, and the times they agree on
"""
