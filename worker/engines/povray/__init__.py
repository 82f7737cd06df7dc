"""POV-Ray: the text it renders, how it is run, and what its answers mean.

scene         the .pov text of a job
ray_camera    rays of the exact trace as a camera
depth_codes   the codes of a depth pass as distances
command       the exact command line
scene_files   the files that a scene names, and the names by which they are found
scene_variables   which variables of POV-Ray a scene reads
environment   the files and variables that POV-Ray finds
progress      POV-Ray's progress, read from its messages
messages      POV-Ray's messages and statistics, unwrapped
places        places in the files of a scene, for messages about ours
diagnosis     what POV-Ray's answers mean and what we do
picture       what a picture of POV-Ray may be, before it is decoded
pixels        its pixels, read without OpenEXR
render        one picture: command, sandbox, process and diagnosis together
version       the installed version
software      the version or the digest of all software that makes pixels
"""
