"""Compute the evidence of lenses in a picture: a field that is high at their centres and low between them.

Of a white image that is its light: every lens is brighter in its middle than at its border, by vignetting or by what
separates the lenses. Of any other picture it is the lack of edges: whatever is shown, it breaks off at the border of
every cell.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

LUMA = np.array([0.299, 0.587, 0.114], dtype=np.float32)
"""The luma of red, green and blue (ITU-R BT.601-7, section 2.5.1), which is what JPEG calls Y."""

BROAD_PX = 32.0
"""The standard deviation of a Gaussian that keeps only changes that are too slow to come from lenses, as vignetting."""

BOXES = 4
"""The boxes in a row that stand for that Gaussian: one rings, which costs a digit of the pitch where lenses are few."""

SOFT_PX = 0.8
"""Standard deviation of what takes the finest grain away, so that a wave between two pixels is as high as on one."""

ALONE_PX = 2
"""A step counts by what it is more than the steps so far before and after it."""

STRONGEST = 99.0
"""Percentile at which edges are cut off: those of things shown are no better evidence for being strong."""

Numbers = NDArray[np.float32]


def tone_of(light: NDArray[Any]) -> Numbers:
    """Return the luma of a picture in sRGB, `(rows, cols)`; below 0 it is that of 0.

    A block of JPEG or of a video codec has its own luma. The chroma of larger blocks does not change it, so that their
    borders do not show in it.

    Parameters
    ----------
    light
        `(rows, cols, channel)`, linear light.
    """
    tone = np.zeros(light.shape[:2], dtype=np.float32)
    weights = LUMA if light.shape[2] == len(LUMA) else np.full(light.shape[2], 1 / light.shape[2], dtype=np.float32)
    for channel, weight in enumerate(weights):
        one = np.maximum(light[..., channel], 0, dtype=np.float32)
        tone += weight * np.where(one <= 0.0031308, 12.92 * one, 1.055 * one ** np.float32(1 / 2.4) - 0.055)
    return tone


def of_white(light: NDArray[np.floating[Any]]) -> Numbers:
    """Return the evidence of a white image, `(rows, cols)`."""
    return _levelled(light)


def of_edges(tone: Numbers) -> Numbers:
    """Return the evidence of any picture, `(rows, cols)`: isolated steps of the tone.

    Cells break off from one pixel to the next, while much of what is shown changes over several.

    Parameters
    ----------
    tone
        See `tone_of`.
    """
    edges = np.zeros_like(tone)
    for axis in (0, 1):
        step = np.abs(np.diff(tone, axis=axis))
        beside = np.maximum(*(np.roll(step, side * ALONE_PX, axis=axis) for side in (-1, 1)))
        step = np.clip(step - beside, 0, None) / 2
        # A step from pixel to pixel lies on the border between the two: half of it is each one's.
        first: list[slice] = [slice(None), slice(None)]
        second = list(first)
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        edges[tuple(first)] += step
        edges[tuple(second)] += step
    return _levelled(-np.minimum(edges, np.percentile(edges, STRONGEST).astype(np.float32)))


def _levelled(field: NDArray[np.floating[Any]]) -> Numbers:
    """Return a field without what changes slowly over it and without its finest grain."""
    from scipy.ndimage import gaussian_filter, uniform_filter

    soft: Numbers = gaussian_filter(field.astype(np.float32, copy=False), SOFT_PX, mode="nearest")
    # Boxes in a row are a Gaussian of their summed variances, and take the same time however broad they are.
    box_px = 2 * int((12 * BROAD_PX**2 / BOXES + 1) ** 0.5 / 2) + 1
    level = soft
    for _ in range(BOXES):
        level = uniform_filter(level, box_px, mode="reflect")
    return soft - level
