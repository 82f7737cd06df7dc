"""Errors of an estimated depth map, by the measures of the 4D light field benchmark.

Measures of Honauer, Johannsen, Kondermann, Goldluecke, *A dataset and evaluation methodology for depth estimation on 4D
light fields*, ACCV 2016. Disparity there is in pixels of a view from one view to the next; a view has one pixel a lens,
so it is in lens pitches.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError

BAD = (0.07, 0.03, 0.01)
"""Errors of the disparity beyond which a pixel counts as bad."""


@dataclass(frozen=True)
class DepthErrors:
    """Errors of a disparity map."""

    badpix_percent: dict[float, float]
    """Pixels with a larger error than each of `BAD`."""
    mse_x100: float
    """Mean square error, times 100, of the pixels that have a value."""
    q25_x100: float
    """The error that the best quarter of the pixels stays below, times 100."""
    pixels: int
    """The number of pixels that are compared."""
    pixels_percent: float
    """The share of these pixels, percent."""


def depth_errors(found: NDArray[np.floating], truth: NDArray[np.floating], *, border_px: int) -> DepthErrors:
    """Compute the errors of a disparity map `(row, col)` where the truth is known, away from the border.

    Parameters
    ----------
    found, truth
        Disparity in pitches a view, `(row, col)`; NaN in `found` is bad, in `truth` it does not count.
    border_px
        How many pixels along each edge do not count.

    Raises
    ------
    LayoutError
        If they differ in size, or nothing is left to judge.
    """
    if found.shape != truth.shape or found.ndim != 2:
        raise LayoutError(f"expected two maps of the same size, got {found.shape} and {truth.shape}")
    inner = np.zeros(truth.shape, dtype=bool)
    inner[border_px : truth.shape[0] - border_px, border_px : truth.shape[1] - border_px] = True
    counted = inner & np.isfinite(truth)
    if not counted.any():
        raise LayoutError(f"expected pixels with a known depth further than {border_px} px from the edge, got none")
    error = np.abs(found[counted].astype(np.float64) - truth[counted])
    error[np.isnan(error)] = np.inf
    known = error[np.isfinite(error)]
    return DepthErrors(
        badpix_percent={limit: float((error > limit).mean() * 100) for limit in BAD},
        mse_x100=float((known**2).mean() * 100) if known.size else float("inf"),
        q25_x100=float(np.quantile(error, 0.25, method="lower") * 100),
        pixels=int(counted.sum()),
        pixels_percent=float(counted.mean() * 100),
    )
