"""POV-Ray: the text it renders, how it is run, and what its answers mean.

engine        POV-Ray behind the protocol of engines
render        one picture: command, sandbox, process and diagnosis together
scene         the .pov text of a job
ray_camera    rays of the exact trace as a camera
command       the exact command line
environment   the files and variables that POV-Ray finds
version       the installed version
software      the version or the digest of all software that makes pixels
scenes/       scenes examined before they are rendered: their files, variables and camera
answers/      what POV-Ray says while it renders, and what it means
pictures/     the pictures that it leaves
"""
