"""The scene.toml of scenes that other programs made.

scene_init      of an own scene of POV-Ray
animation_ini   the options of an .ini beside such a scene
model_init      of a glTF model
splat_init      of Gaussian splats
"""
