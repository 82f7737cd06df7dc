"""Refocus: the views shifted by what a depth asks for, and added; stacks of depths, and the sharpest of each pixel.

Depths s are the **display's**: millimetres from its array, positive in front of it, on a display whose array stands one
focal length f before its pixels (pinholes at gap f). What the capture's array saw at s lies at s + f there
(docs/optics.md, Depth).

By the law of small angles a point at s moves over the lenses by delta = s / (n f) pitches from one view to the next, n
pixels a lens: for s > 0 to the left as the eye moves right, and up as it moves down. A refocused picture takes every
view from where the point would have moved to and averages; the middle of the views stays where it is. Shifts between
lenses are interpolated linearly, in linear light. Pixels of a view that would come from beyond the array do not count.

On the hexagonal lattice the views are put on square pixels first (`as_square`), which lie a pitch apart both ways.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.errors import LayoutError
from worker.integral.hexagon import ROW_PITCH
from worker.integral.interpolation import SNAP, Light, working
from worker.integral.layout import CellLayout, check_sheet
from worker.integral.square_pixels import as_square, square_size
from worker.integral.views import view, view_numbers

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Of linear red, green and blue (ITU-R BT.709)."""


def shifts(layout: CellLayout, depth_mm: float, *, focal_mm: float) -> tuple[float, float]:
    """Return by how many pitches a point at a depth moves from one view to the next, as (down, across).

    Positive: against the eye. The two differ by little, and on the hexagonal lattice only, where pixels are not quite
    square.

    Raises
    ------
    LayoutError
        If the depth is no number, or the focal length is not positive.

    Examples
    --------
    >>> down, across = shifts(CellLayout(90, 90, 8), 40.0, focal_mm=3.3)
    >>> round(across, 3)
    1.515
    """
    if not (math.isfinite(depth_mm) and math.isfinite(focal_mm) and focal_mm > 0):
        raise LayoutError(f"expected a depth and a positive focal length in mm, got {depth_mm} and {focal_mm}")
    row_pitch = 1.0 if layout.lattice == "square" else ROW_PITCH
    return depth_mm / focal_mm * row_pitch / layout.row_px, depth_mm / focal_mm / layout.px_per_lens


def refocus(
    ortho: NDArray[Light], layout: CellLayout, depth_mm: float, *, focal_mm: float
) -> NDArray[np.floating[Any]]:
    """Return the picture that is sharp at one depth; see the module.

    Parameters
    ----------
    ortho
        Orthoscopic sheet `(rows, cols, channel)`, linear light.
    layout
        How its pixels lie under the lenses.
    depth_mm
        s of the display, positive in front of it.
    focal_mm
        Of the lenses, and the display's gap.

    Returns
    -------
    NDArray
        `(*square_size(layout), channel)`, in single precision or the sheet's, if higher. At depth 0 the mean of all
        views.

    Raises
    ------
    LayoutError
        As in `focal_stack`.
    """
    return focal_stack(ortho, layout, (depth_mm,), focal_mm=focal_mm)[0]  # type: ignore[no-any-return]


def focal_stack(
    ortho: NDArray[Light], layout: CellLayout, depths_mm: Sequence[float], *, focal_mm: float
) -> NDArray[np.floating[Any]]:
    """Return the pictures that are sharp at several depths.

    The sheet is read view by view, once for all depths; memory beside it is twice the result.

    Parameters
    ----------
    ortho, layout, focal_mm
        As in `refocus`.
    depths_mm
        At least one.

    Returns
    -------
    NDArray
        `(depth, *square_size(layout), channel)`, as in `refocus`.

    Raises
    ------
    LayoutError
        If the sheet is not of this layout, or a depth is so far off that neighbouring views do not overlap.
    """
    check_sheet(ortho, layout)
    steps = [_checked_shifts(layout, depth_mm, focal_mm) for depth_mm in depths_mm]
    rows, cols = square_size(layout)
    light = np.result_type(ortho.dtype, np.float32)
    stack = np.zeros((len(steps), rows, cols, ortho.shape[2]), dtype=light)
    counted = np.zeros((len(steps), rows, cols, 1), dtype=light)
    for v, numbers in groupby(view_numbers(layout), key=lambda number: number[1]):
        # Shifts across and down are separable: a row of views is summed across, and the sum goes down once.
        across, count = np.zeros_like(stack), np.zeros((len(steps), 1, cols, 1), dtype=light)
        for u, _ in numbers:
            picture = as_square(working(view(ortho, layout, u, v)), layout)
            for index, (_, step) in enumerate(steps):
                shift = -step * (u - (layout.cell_cols - 1) / 2)
                _add(across[index], picture, shift, axis=1)
                _add(count[index], np.ones((1, cols, 1), dtype=light), shift, axis=1)
        for index, (step, _) in enumerate(steps):
            shift = -step * (v - (layout.cell_rows - 1) / 2)
            _add(stack[index], across[index], shift, axis=0)
            _add(counted[index], np.broadcast_to(count[index], (rows, cols, 1)), shift, axis=0)
    # Neighbouring views overlap, so every pixel is counted at least once.
    stack /= counted
    return stack


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


def _checked_shifts(layout: CellLayout, depth_mm: float, focal_mm: float) -> tuple[float, float]:
    found = shifts(layout, depth_mm, focal_mm=focal_mm)
    for lenses, views, step in zip(square_size(layout), (layout.cell_rows, layout.cell_cols), found, strict=True):
        if views > 1 and abs(step) > lenses - 1:
            raise LayoutError(
                f"expected a depth at which neighbouring views of {layout} overlap, at most"
                f" {abs(depth_mm / step) * (lenses - 1):g} mm from the display, got {depth_mm:g} mm"
            )
    return found


def _add(total: NDArray[Any], picture: NDArray[Any], shift: float, *, axis: int) -> None:
    """Add to every place of a total the picture `shift` pixels further along an axis, where there is one."""
    shift = round(shift * SNAP) / SNAP
    whole = math.floor(shift)
    weight = shift - whole
    length = picture.shape[axis]
    first, last = max(0, -whole), min(length, length - whole - (weight > 0))
    if first >= last:
        return
    place = _along(axis, first, last)
    near = picture[_along(axis, first + whole, last + whole)]
    if not weight:
        total[place] += near
        return
    far = picture[_along(axis, first + whole + 1, last + whole + 1)]
    total[place] += near + (far - near) * picture.dtype.type(weight)


def _along(axis: int, start: int, stop: int) -> tuple[slice, ...]:
    return (slice(None),) * axis + (slice(start, stop),)


def _box_sum(values: NDArray[np.float64], half: int, *, axis: int) -> NDArray[np.float64]:
    """Return the sums over 2 half + 1 neighbours along an axis, beyond the border by the outermost ones."""
    widths = [(0, 0)] * values.ndim
    widths[axis] = (half, half)
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(values, widths, mode="edge"), 2 * half + 1, axis=axis)
    total: NDArray[np.float64] = windows.sum(axis=-1)
    return total
