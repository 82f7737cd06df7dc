"""The sources of the pictures of a job.

scene            scenes: stage, clock and parameters
stage            the position of the rig in a scene, and the scale
scene_camera     the camera of a scene, and the place of a rig that follows it
imported_sheets  bundles of imported integral images, in place of a scene
"""
