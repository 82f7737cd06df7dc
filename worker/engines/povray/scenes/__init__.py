"""Scenes of POV-Ray, examined before they are rendered.

scene_files       the files that a scene names, and the names by which they are found
scene_variables   which variables of POV-Ray a scene reads
scene_camera      the camera of a scene, as POV-Ray reports it
"""
