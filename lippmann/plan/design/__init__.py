"""The designer: the properties of a job, in numbers, before anything is rendered.

design            the data of a design, with units in their names
designer          computes the design of a job, and draws its optics
lens              the imaging lens: conjugates, exact images, spots, spherical aberration
display           the display: device, gaps, viewing angle and zone, resolvable depth
gaps              the gap between pixels and lenses
depths            the depths at which a display shows the scene
sharp_maps        the depths at which to focus on the surfaces of a view
observed_display  the display that an observer looks at
notes             notes and warnings in words
estimate          memory and time before anything is measured
"""
