"""The text that POV-Ray reads, and the built-in scenes. This package imports nothing of the project.

include/lippmann/           the include library: plain SDL macros for stage, glass, imaging lens, lens array, capture,
                            ray camera and depth, which a person can use by hand
include/lippmann/examples/  one scene for each include file, for plain POV-Ray
rigs/                       templates of the .pov files that the farm renders: numbers and no loops
scenes/<name>/              scene.inc, or a scene for Mitsuba with its meshes; scene.toml, textures, poster.png
catalogue                   the folders of the above, and the scenes by name
literals                    Python values as SDL text
write                       filled-in templates
"""
