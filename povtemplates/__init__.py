"""What POV-Ray is told. Text only; imports nothing of ours.

include/lippmann/  plain SDL macros that a person can #include by hand: stage, glass, imaging lens, lens array, capture,
                   ray camera
include/examples/  one scene by hand for each of them
rigs/              the heads of the .pov files that the farm renders: numbers and no loops
scenes/<name>/     scene.inc, scene.toml, textures, poster.png
catalogue          where these lie, and the scenes by name
manifest           the text of a scene.toml, as data
literals           Python values as SDL text
write              a rig's head filled in
"""
