"""Scenes of Mitsuba from the files of a bundle.

splat_file    Gaussian splats from a .ply, within limits
splats        Gaussian splats as a scene, and the light that rays receive from them
"""
