"""Calibrate the lenses of a picture from elsewhere from its pixels.

flat_field     a picture divided by a white image
evidence       the evidence of lenses: light in a white image, edges in any other picture
periods        white images: the two shortest steps from lens to lens, roughly, by autocorrelation
phases         pitch, rotation and position to a fraction of a pixel, by the phases of the waves of the lattice
spectrum       any picture: the lines that stand out from its spectrum
combs          any picture: the lattice by these lines
borders        any picture: whether what is shown breaks off at the borders of the cells, and the lattice by them
interference   any picture: whether a clearer grid, as of the blocks of a codec, makes the pitch uncertain
whole_lenses   the largest block of lenses that lie completely on a picture
calibrate      the calibration, and its reliability
imported       a calibrated picture resampled to an orthoscopic sheet

Steps and places are px, `(right, down)` where they are vectors, as a lattice's waves have them.
"""
