"""The optics of a job, and how its display is viewed.

glasses          optical materials by name: refractive index and Abbe number
lens             imaging lenses: prescriptions, surface by surface
rig              the rig: imaging lens, microlens array, camera and device
viewing          terms and defaults for viewing a display: eyes, gaps, stereo pairs, resampling filters
"""
