"""Compute the evidence of lenses in a picture: a field that is high at their centres and low between them.

Of a white image that is its light: every lens is brighter in its middle than at its border, by vignetting or by what
separates the lenses. Of any other picture it is the lack of edges: whatever is shown, it breaks off at the border of
every cell.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

BROAD_PX = 32.0
"""The standard deviation of a Gaussian that keeps only changes that are too slow to come from lenses, as vignetting."""

SOFT_PX = 0.8
"""Standard deviation of what takes the finest grain away, so that a wave between two pixels is as high as on one."""

ALONE_PX = 2
"""A step counts by what it is more than the steps so far before and after it."""

STRONGEST = 99.0
"""Percentile at which edges are cut off: those of things shown are no better evidence for being strong."""


def of_white(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the evidence of a white image, `(rows, cols)`."""
    return _levelled(light)


def of_edges(light: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the evidence of any picture, `(rows, cols)`: isolated steps of the tone.

    Cells break off from one pixel to the next, while much of what is shown changes over several.
    """
    shown = np.cbrt(np.clip(light, 0, None))
    edges = np.zeros_like(shown)
    # A step from pixel to pixel lies on the border between the two: half of it is each one's.
    for axis in (0, 1):
        step = np.abs(np.diff(shown, axis=axis))
        before, after = (np.roll(step, side * ALONE_PX, axis=axis) for side in (-1, 1))
        step = np.clip(step - np.maximum(before, after), 0, None)
        first: list[slice] = [slice(None), slice(None)]
        second = list(first)
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        edges[tuple(first)] += step / 2
        edges[tuple(second)] += step / 2
    return _levelled(-np.minimum(edges, np.percentile(edges, STRONGEST)))


def _levelled(field: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a field without what changes slowly over it and without its finest grain."""
    from scipy.ndimage import gaussian_filter

    soft: NDArray[np.float64] = gaussian_filter(field, SOFT_PX, mode="nearest")
    # A box would do in less time; its sharp ends ring, which costs a digit of the pitch where lenses are few.
    level: NDArray[np.float64] = soft - gaussian_filter(soft, BROAD_PX, mode="reflect", truncate=3.0)
    return level
