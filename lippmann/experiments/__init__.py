"""The paper's experiments, done here and now: Athineos et al., J. Electronic Imaging 15(4), 2006.

run              one figure from its name: what is needed is there, its numbers are written
request          what a figure is asked for, and what it made
machine          what it was made on
settings         the jobs of the paper, and their small stand-ins

sample           Figs. 3 and 4: a sample capture with a square and a hexagonal array
lens_image       Fig. 5: the scene, and its image behind the imaging lens
sweep            Fig. 7: four positions of the array in one job
growth           Fig. 8: rendering time against pixels per lens
antialiasing     Fig. 9: rendering time against the antialiasing threshold
video            Figs. 10 and 11: two frames of an integral video, and their views

frames           a job's frames by the steps that a worker takes
timing           one picture on one thread, timed
depth            depth measured in the views
landmarks        points of the fish scene, and where the exact trace has them in every view
captions         what the captions of Fig. 7 say, against measured depths
fits             straight lines through measured times
plain_camera     a camera without the array: of the scene, or behind the imaging lens
panels           pictures side by side, pixel for pixel, with words
"""
