"""Imaging lenses: prescriptions, ray-transfer matrices and the exact trace.

surfaces       the model of an imaging lens: surfaces, media, a stop
asphere        the sag of conics and even polynomials, and their intersection with rays
published      published lenses
prescription   the imaging lens of a rig: selected, scaled and checked, with its stop set
matrices       ray-transfer matrices, cardinal points, conjugates (paraxial)
stop           the position of the aperture stop, and its diameter for an f-number
check          checks that a lens can be built and transmits light
dispersion     the dispersion of POV-Ray for an Abbe number
ray            rays by their components, on any library of arrays
trace          the exact trace of skew rays through imaging lenses
field_spots    the spots of distant points, by the exact trace
"""
