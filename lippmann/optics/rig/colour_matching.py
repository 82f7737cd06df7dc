"""The share of a wavelength in each channel of linear sRGB.

The CIE 1931 2-degree colour matching functions are taken in the multi-lobe fit of Wyman, Sloan and Shirley, "Simple
Analytic Approximations to the CIE XYZ Color Matching Functions", Journal of Computer Graphics Techniques 2(2), 2013,
equation 4 and its table. XYZ becomes linear sRGB by the matrix of IEC 61966-2-1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LOBES = (
    ((1.056, 599.8, 37.9, 31.0), (0.362, 442.0, 16.0, 26.7), (-0.065, 501.1, 20.4, 26.2)),
    ((0.821, 568.8, 46.9, 40.5), (0.286, 530.9, 16.3, 31.1)),
    ((1.217, 437.0, 11.8, 36.0), (0.681, 459.0, 26.0, 13.8)),
)
"""The lobes of x, y and z: height, centre, and the widths below and above the centre, nm."""

_XYZ_TO_SRGB = np.array([[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]])

_STEPS = 64
"""The steps of a band in the integral over it."""


def colour_matching(wavelengths_nm: Array) -> Array:
    """Return the CIE 1931 colour matching functions x, y and z at wavelengths, float64 (..., 3).

    Parameters
    ----------
    wavelengths_nm
        The wavelengths, float64 (...), nm.

    Examples
    --------
    >>> colour_matching(np.array([445.0, 555.0, 600.0])).round(2).tolist()
    [[0.36, 0.03, 1.78], [0.52, 1.0, 0.01], [1.06, 0.63, 0.0]]
    """
    curves = []
    for lobes in _LOBES:
        curve = np.zeros_like(wavelengths_nm)
        for height, centre_nm, below_nm, above_nm in lobes:
            away_nm = wavelengths_nm - centre_nm
            curve += height * np.exp(-0.5 * (away_nm / np.where(away_nm < 0, below_nm, above_nm)) ** 2)
        curves.append(curve)
    return np.stack(curves, axis=-1)


def srgb_weights(edges_nm: Array) -> Array:
    """Return the share of each wavelength band in each channel of linear sRGB, float64 (band, 3).

    A spectrum of equal energy is integrated over every band. sRGB cannot show pure colours of the spectrum, so the
    matching functions of its channels have negative lobes; these count as zero, since a negative share would make light
    negative beside an edge. The shares of a channel are scaled to the sum 1, so that white stays white.

    Parameters
    ----------
    edges_nm
        The edges of the bands in ascending order, float64 (band + 1), nm.
    """
    low, wide = edges_nm[:-1, np.newaxis], np.diff(edges_nm)[:, np.newaxis]
    inside_nm = low + wide * (np.arange(_STEPS) + 0.5) / _STEPS
    light = np.clip(colour_matching(inside_nm) @ _XYZ_TO_SRGB.T, 0.0, None).mean(axis=1) * wide
    shares: Array = light / light.sum(axis=0)
    return shares
