"""Extended focus: of a focal stack, every pixel from the picture that is the sharpest about it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.errors import LayoutError
from worker.integral.interpolation import Light

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Of linear red, green and blue (ITU-R BT.709)."""


@dataclass(frozen=True)
class ExtendedFocus:
    """What is sharp at every depth."""

    picture: NDArray[np.floating[Any]]
    """`(row, col, channel)`."""
    nearest: NDArray[np.intp]
    """Which of the stack's pictures each pixel is of, `(row, col)`."""


def extended_focus(stack: NDArray[Light], *, smooth_px: int = 2) -> ExtendedFocus:
    """Return each pixel from the picture of a focal stack that is the sharpest about it.

    Sharpness is local contrast: the modified Laplacian of the luminance, |d2/dx2| + |d2/dy2| (Nayar, Nakagawa 1994),
    summed over a square of 2 `smooth_px` + 1. Of equally sharp ones the first is taken.

    Parameters
    ----------
    stack
        `(depth, row, col, channel)`, linear light; three channels are red, green and blue.
    smooth_px
        Half the side of the square; more gives calmer pictures with coarser borders between depths.

    Raises
    ------
    LayoutError
        If there is no picture in the stack.
    """
    if stack.ndim != 4 or not stack.shape[0]:
        raise LayoutError(f"expected a stack (depth, row, col, channel), got an array of shape {stack.shape}")
    best = np.full(stack.shape[1:3], -np.inf)
    nearest = np.zeros(stack.shape[1:3], dtype=np.intp)
    for index, picture in enumerate(stack):
        sharp = sharpness(picture, smooth_px=smooth_px)
        nearest[sharp > best] = index
        np.maximum(best, sharp, out=best)
    picture = np.take_along_axis(stack, nearest[np.newaxis, :, :, np.newaxis], axis=0)[0]
    return ExtendedFocus(picture=picture, nearest=nearest)


def sharpness(picture: NDArray[Light], *, smooth_px: int) -> NDArray[np.float64]:
    """Return the local contrast of a picture `(row, col, channel)`, `(row, col)`; see `extended_focus`."""
    weights = LUMINANCE if picture.shape[2] == len(LUMINANCE) else np.full(picture.shape[2], 1 / picture.shape[2])
    light = np.pad(picture.astype(np.float64) @ np.asarray(weights), 1, mode="edge")
    middle = 2 * light[1:-1, 1:-1]
    contrast: NDArray[np.float64] = np.abs(middle - light[1:-1, :-2] - light[1:-1, 2:])
    contrast += np.abs(middle - light[:-2, 1:-1] - light[2:, 1:-1])
    for axis in (0, 1):
        contrast = _box_sum(contrast, smooth_px, axis=axis)
    return contrast


def _box_sum(values: NDArray[np.float64], half: int, *, axis: int) -> NDArray[np.float64]:
    """Return the sums over 2 half + 1 neighbours along an axis, beyond the border by the outermost ones."""
    widths = [(0, 0)] * values.ndim
    widths[axis] = (half, half)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, widths, mode="edge"), 2 * half + 1, axis=axis)
    total: NDArray[np.float64] = windows.sum(axis=-1)
    return total
