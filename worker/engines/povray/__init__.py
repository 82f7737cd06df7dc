"""POV-Ray: what it is told, how it is run and held, what its answers mean.

bundle        scene bundles: folder or zip, checked, named by their content
scene         the .pov text of a job
ray_camera    rays as a camera, for optics traced elsewhere
depth_codes   codes of a depth pass as distances
command       the exact command line
environment   what POV-Ray finds around it
limits        CPU, memory and file sizes, held by the kernel
sandbox       bubblewrap or Landlock
landlock      the launcher for the latter
child         a child process that ends with its parent
process       the one owner of a running POV-Ray
progress      how far it is
messages      what it says, unwrapped
diagnosis     what its answers mean and what we do
log           the log of one attempt
render        one picture: all of it tied together
version       which POV-Ray is installed
"""
