"""Linear interpolation between neighbours in one line of pixels."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Light = TypeVar("Light", bound=np.floating[Any])

SNAP = 2.0**20
"""Positions are rounded to 1 / SNAP px, so that equal grids give equal pixels whatever the rounding errors."""


def working(light: NDArray[Light]) -> NDArray[np.floating[Any]]:
    """Return light in single precision, or its own if that is higher, for arithmetic."""
    return light.astype(np.result_type(light.dtype, np.float32))


def neighbours(
    at: NDArray[np.float64], low: ArrayLike, high: ArrayLike
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Return the neighbouring pixels of positions and the weight of the second; positions are clipped to a range.

    Parameters
    ----------
    at
        Positions, px; whole numbers are centres of pixels.
    low, high
        The first and the last pixel that may be taken; they broadcast with the positions.
    """
    held = np.clip(np.round(at * SNAP) / SNAP, low, high)
    first = np.floor(held).astype(np.intp)
    weight = held - first
    return first, first + (weight > 0), weight


def between(
    first: NDArray[np.floating[Any]], second: NDArray[np.floating[Any]], weight: NDArray[np.float64]
) -> NDArray[np.floating[Any]]:
    """Interpolate linearly, in the precision of the pixels; between equal pixels the result is exactly these.

    Parameters
    ----------
    first, second
        Pixels of one shape, floating.
    weight
        The weight of the second, 0 to 1; broadcasts with the pixels.
    """
    if not weight.any():
        return first
    step: NDArray[np.floating[Any]] = (second - first) * weight.astype(first.dtype)
    return first + step
