"""All-in-focus pictures: every pixel of a focal stack from the pictures that are the sharpest around it.

Sharpness is local contrast: the modified Laplacian of the luminance, |d2/dx2| + |d2/dy2| (Nayar, Nakagawa, *Shape from
focus*, IEEE Trans. Pattern Analysis and Machine Intelligence 16(8), 1994), here of its square root, which is nearer to
what an eye sees, summed over a square. Every picture of the stack counts by a power of its sharpness: where one is
sharper than the others it is nearly alone, and where nothing is sharp, as in a sky, all are averaged, which is as
smooth as they are. Taking the sharpest alone would break such a place into patches of one depth and another.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lightfield.quality.luminance import luminance
from lippmann.lightfield.sheet.interpolation import Light

POWER = 8
"""The power of the sharpness by which a picture is weighted: half the sharpness has 1 / 256 of the weight."""

NOTHING_SHARP = 0.05
"""The sharpness that makes no difference, as a share of that of the sharpest tenth of all pixels."""


@dataclass(frozen=True)
class AllInFocus:
    """A picture that is sharp at every depth, and which pictures of the stack it comes from."""

    picture: NDArray[np.floating[Any]]
    """`(row, col, channel)`, in single precision or the dtype of the stack, if higher."""
    nearest: NDArray[np.intp]
    """The number of the sharpest picture of the stack, `(row, col)`; of equally sharp ones the first."""


def all_in_focus(stack: NDArray[Light], *, smooth_px: int = 2) -> AllInFocus:
    """Blend a focal stack so that each pixel comes from the pictures that are the sharpest around it; see the module.

    Parameters
    ----------
    stack
        `(depth, row, col, channel)`, linear light; three channels are red, green and blue.
    smooth_px
        Half the side of the square, 2 `smooth_px` + 1, over which sharpness is summed, px; a larger one gives smoother
        pictures with coarser borders between depths.

    Raises
    ------
    LayoutError
        If there is no picture in the stack.
    """
    if stack.ndim != 4 or not stack.shape[0]:
        raise LayoutError(f"expected a stack (depth, row, col, channel), got an array of shape {stack.shape}")
    sharp = np.stack([sharpness(np.sqrt(np.maximum(picture, 0)), smooth_px=smooth_px) for picture in stack])
    best = sharp.max(axis=0)
    floor = max(NOTHING_SHARP * float(np.quantile(best, 0.9)), float(np.finfo(np.float64).tiny))
    weights = ((sharp + floor) / (best + floor)) ** POWER
    weights /= weights.sum(axis=0)
    picture = np.zeros(stack.shape[1:], dtype=np.result_type(stack.dtype, np.float32))
    for one, weight in zip(stack, weights, strict=True):
        picture += one * weight[..., np.newaxis].astype(picture.dtype)
    return AllInFocus(picture=picture, nearest=sharp.argmax(axis=0))


def sharpness(picture: NDArray[Light], *, smooth_px: int) -> NDArray[np.float64]:
    """Compute the local contrast of a picture; see the module.

    Parameters
    ----------
    picture
        `(row, col, channel)`, floating.
    smooth_px
        As in `all_in_focus`, px.

    Returns
    -------
    NDArray
        `(row, col)`, float64.
    """
    light = np.pad(luminance(picture), 1, mode="edge")
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
