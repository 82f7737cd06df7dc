"""The experiments of the paper, repeated: Athineos et al., J. Electronic Imaging 15(4), 2006.

run              make one figure by its name: check what it needs, write its numbers
request          the request for a figure, and its result
machine          the machine on which a figure was made
settings         the jobs of the paper, and their small versions

figures/sample        Figs. 3 and 4: a sample capture with a square and a hexagonal array
figures/lens_image    Fig. 5: the scene, and its image behind the imaging lens
figures/sweep         Fig. 7: four positions of the array in one job
figures/captions      the captions of Fig. 7, against measured depths
figures/depth         depth measured in the views
figures/growth        Fig. 8: rendering time against pixels per lens
figures/antialiasing  Fig. 9: rendering time against the antialiasing threshold
figures/video         Figs. 10 and 11: two frames of an integral video, and their views

frames           the frames of a job, rendered with the steps of a worker
timing           the rendering time of one picture on one thread
landmarks        points of the fish scene, and their positions in every view by the exact trace
fits             straight lines through measured times
plain_camera     a camera without the array: of the scene, or behind the imaging lens
panels           pictures side by side, pixel for pixel, with captions
"""
