"""Dispersion as POV-Ray models it, from an Abbe number.

POV-Ray 3.7 (`SpectralBand::GetDispersionIOR` in source/backend/colour/spectral.h, used by `Trace::ComputeRefraction`)
takes the `ior` of a medium for 555 nm and gives it, at a wavelength, the index

    n(wavelength) = ior * dispersion^((555 nm - wavelength) / 350 nm)

so that `dispersion` is the ratio of the indices at 380 nm and at 730 nm; a glass without dispersion has 1.
"""

from __future__ import annotations

import math

LINE_F_NM = 486.1327
LINE_D_NM = 587.5618
LINE_C_NM = 656.2725
"""The Fraunhofer lines of the Abbe number Vd = (nd - 1) / (nF - nC)."""

POVRAY_WIDTH_NM = 350.0


def povray_dispersion(index: float, abbe: float | None) -> float:
    """Return the `dispersion` that gives a glass of index nd its Abbe number; 1 without one.

    With n(wavelength) as above, (nF - nC) / nd = D^((d - F) / 350) - D^((d - C) / 350), solved for ln D by Newton's
    method from its first order, ln D = (nd - 1) / (nd Vd) * 350 / (C - F).

    Parameters
    ----------
    index
        The index nd of the glass at the d line.
    abbe
        The Abbe number Vd; None for a glass without dispersion.

    Examples
    --------
    >>> round(povray_dispersion(1.5168, 64.17), 5)
    1.01098
    """
    if abbe is None or index == 1.0:
        return 1.0
    spread = (index - 1.0) / (index * abbe)
    blue, red = (LINE_D_NM - LINE_F_NM) / POVRAY_WIDTH_NM, (LINE_D_NM - LINE_C_NM) / POVRAY_WIDTH_NM
    log = spread / (blue - red)
    for _ in range(4):
        miss = math.exp(blue * log) - math.exp(red * log) - spread
        log -= miss / (blue * math.exp(blue * log) - red * math.exp(red * log))
    return math.exp(log)


def povray_index(index: float, dispersion: float, wavelength_nm: float) -> float:
    """Return the index that POV-Ray gives, at a wavelength, a glass of index nd built with `Lippmann_Glass`.

    Parameters
    ----------
    index
        The index nd of the glass at the d line.
    dispersion
        The value of the keyword `dispersion`, see `povray_dispersion`.
    wavelength_nm
        The wavelength, nm.
    """
    return index * math.pow(dispersion, (LINE_D_NM - wavelength_nm) / POVRAY_WIDTH_NM)
