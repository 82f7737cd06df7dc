"""Published imaging lenses with their sources, as in the printed tables, at the printed size."""

from __future__ import annotations

import math
from types import MappingProxyType

from lippmann.optics.lens.surfaces import ImagingLens, Surface

_INF = math.inf

ATHINEOS_2006 = ImagingLens(
    name="athineos-2006",
    title="Two plano-convex condenser lenses and a thick plano-convex lens, 300 mm f/1.5",
    source="Athineos et al., J. Electronic Imaging 15(4), 2006, Table 1, doi 10.1117/1.2360692",
    surfaces=(
        Surface(_INF, 84.28, 1.51, 100.0),
        Surface(-242.38, 289.30, 1.0, 100.0),
        Surface(_INF, 17.16, 1.50, 100.0),
        Surface(-300.0, 0.0, 1.0, 100.0),
        Surface(300.0, 17.16, 1.50, 100.0),
        Surface(_INF, 0.0, 1.0, 100.0),
    ),
)
"""The lens of the paper, which includes a variable aperture at an unknown position; see `stop.stop_place_mm`."""

TRONNIER_1954 = ImagingLens(
    name="double-gauss-tronnier",
    title="Double Gauss, 50 mm f/2, 22 degrees half field",
    source="US patent 2,673,491 (Tronnier, 1954): radii, thicknesses, indices and Abbe numbers, times 50 mm; clear "
    "apertures and the place of the stop as in W. J. Smith, Modern Lens Design (1992), p. 312",
    surfaces=(
        Surface(29.475, 3.76, 1.67125, 12.6, abbe_after=47.1),
        Surface(84.83, 0.12, 1.0, 12.6),
        Surface(19.275, 4.025, 1.67125, 11.5, abbe_after=47.1),
        Surface(40.77, 3.275, 1.69842, 11.5, abbe_after=30.1),
        Surface(12.75, 10.205, 1.0, 9.0),
        Surface(-14.495, 1.18, 1.60266, 8.5, abbe_after=38.4),
        Surface(40.77, 6.065, 1.65953, 10.0, abbe_after=57.0),
        Surface(-20.385, 0.19, 1.0, 10.0),
        Surface(437.065, 3.22, 1.7174, 10.0, abbe_after=48.1),
        Surface(-39.73, 0.0, 1.0, 10.0),
    ),
    stop_z_mm=16.885,
)

COOKE_TRIPLET = ImagingLens(
    name="cooke-triplet",
    title="Cooke triplet, 50 mm f/5, 20 degrees half field",
    source="Zemax sample 'A simple Cooke triplet' (Cooke 40 degree field), glasses Schott SK16 and F2; its stop lies "
    "on the rear surface of the flint, here in the air beside the rim of that surface",
    surfaces=(
        Surface(22.01359, 3.258956, 1.62041, 9.5, abbe_after=60.32),
        Surface(-435.76044, 6.007551, 1.0, 9.5),
        Surface(-22.21328, 0.999975, 1.62004, 5.0, abbe_after=36.37),
        Surface(20.29192, 4.750409, 1.0, 5.0),
        Surface(79.68360, 2.952076, 1.62041, 7.5, abbe_after=60.32),
        Surface(-18.39533, 0.0, 1.0, 7.5),
    ),
    stop_z_mm=10.9,
)

IMAGING_LENSES = MappingProxyType({lens.name: lens for lens in (ATHINEOS_2006, TRONNIER_1954, COOKE_TRIPLET)})
"""The lenses that a job can name."""
