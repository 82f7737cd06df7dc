"""Rate against distortion: how much a codec saves against another, by Bjøntegaard's measure.

G. Bjøntegaard, *Calculation of average PSNR differences between RD-curves*, ITU-T SG16 VCEG-M33 (2001), with piecewise
cubic interpolation in place of the one polynomial, as the common test conditions of JCT-VC and JVET have it: the
logarithm of the rate is a function of the PSNR, monotone where the points are, and the mean difference of two of them
over the PSNRs that both reach is the difference of rate at the same quality.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError

Curve = Sequence[tuple[float, float]]
"""Points (rate, PSNR in dB) of one codec, in any order and any unit of rate."""

LEAST_POINTS = 2


def bd_rate(reference: Curve, tested: Curve) -> float:
    """Return by what share the tested codec needs more rate than the reference, at the same quality; negative: less.

    Parameters
    ----------
    reference, tested
        At least two points each, whose PSNR rises with the rate; rates above 0.

    Returns
    -------
    float
        0.1 is ten per cent more; NaN if no PSNR is reached by both.

    Raises
    ------
    LayoutError
        If a curve has fewer points, or one that is no rise.

    Examples
    --------
    >>> half = [(1.0, 30.0), (2.0, 33.0), (4.0, 36.0)]
    >>> round(bd_rate([(2 * rate, psnr) for rate, psnr in half], half), 6)
    -0.5
    """
    from scipy.interpolate import PchipInterpolator

    curves = [_rising(curve) for curve in (reference, tested)]
    low = max(psnr[0] for psnr, _ in curves)
    high = min(psnr[-1] for psnr, _ in curves)
    if low >= high:
        return float("nan")
    mean = [PchipInterpolator(psnr, log_rate).integrate(low, high) / (high - low) for psnr, log_rate in curves]
    return float(np.exp(mean[1] - mean[0]) - 1)


def _rising(curve: Curve) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (PSNRs, logarithms of rates), rising."""
    points = np.array(sorted(curve, key=lambda point: point[1]), dtype=np.float64)
    if len(points) < LEAST_POINTS or not np.isfinite(points).all() or points[:, 0].min() <= 0:
        raise LayoutError(f"expected at least {LEAST_POINTS} points of a rate above 0 and a finite PSNR, got {curve}")
    if (np.diff(points[:, 0]) <= 0).any() or (np.diff(points[:, 1]) <= 0).any():
        raise LayoutError(f"expected a PSNR that rises with the rate, got {curve}")
    return points[:, 1], np.log(points[:, 0])
