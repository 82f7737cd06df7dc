"""Where the lenses of a picture from elsewhere are, found in its pixels.

evidence       what of a picture tells of lenses: light from a white image, edges from any other
periods        white: the two shortest steps from lens to lens, roughly, by autocorrelation
phases         pitch, turn and place to a fraction of a pixel, by the phases of the lattice's waves
combs          any picture: the lattice by the lines of its spectrum
whole_lenses   the largest block of lenses that lie on a picture whole
find           all of it, and how far it can be believed

Steps and places are px, `(right, down)` where they are vectors, as a lattice's waves have them.
"""
