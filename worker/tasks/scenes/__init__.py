"""The scene of a task: its files and its own camera.

bundle_folder   the files of a scene bundle, unpacked once
folder_lock     the lock of a folder, between processes
scene_camera    the scene's own camera: where it stands at a frame, and where the rig stands by it
own_view        the view of that camera: how far away the objects are
scene_notes     notes on what a farm or the rig does otherwise than POV-Ray does
"""
