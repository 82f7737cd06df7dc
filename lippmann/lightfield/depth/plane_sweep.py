"""Depth estimation by plane sweep: at each depth, a view is compared with the shifted others.

At every depth the other views are shifted as refocus shifts them (`refocus.shift_and_sum`), by cubic splines, and
compared with the view that the depth is wanted of. Where the depth is right, they agree. What another thing hides from
half of the views still agrees in the other half, so only the better half of the views counts (Kang, Szeliski, Chai,
*Handling occlusions in dense multi-view stereo*, CVPR 2001).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.shift_and_sum import shifts
from lippmann.lightfield.sheet.interpolation import working
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import view, view_numbers

REACH = 2
"""The views to each side that are compared. Farther views separate small depths better, but with an imaging lens of
strong spherical aberration points do not move evenly over them (docs/depth.md)."""

WINDOW_PX = 1
"""Half the side of the square over which a pixel is compared, px; one pixel alone fits many depths."""

UNLIKE = 0.2
"""The largest difference of two pixels that counts; pixels that differ by more show two objects."""

STEP = 0.25
"""Shift of the farthest view, in pitches, from one depth of a sweep to the next where none are given."""

Map = NDArray[np.float32]
Picture = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class DepthEstimate:
    """The estimated depth of a view, one value for each square pixel."""

    s_mm: Map
    """`(row, col)`: of the display, positive in front of it."""
    confidence: Map
    """`(row, col)`, 0 to 1: how much better the depth fits than depths on the average; 0 where all fit alike."""


def plane_sweep(
    image: IntegralImage,
    number: tuple[int, int],
    depths_mm: Sequence[float],
    *,
    reach: int = REACH,
    window_px: int = WINDOW_PX,
) -> DepthEstimate:
    """Estimate the depth of a view by a plane sweep; see the module.

    Parameters
    ----------
    image
        An orthoscopic image.
    number
        The view, (u, v).
    depths_mm
        The depths s that are compared, mm in front of the display, rising by even steps; the depth between two of them
        is interpolated.
    reach, window_px
        The views to each side, and half the side of the compared squares, px; see `REACH` and `WINDOW_PX`.

    Raises
    ------
    LayoutError
        If there is no such view, it has no neighbours, fewer than three depths are given, or the image is pseudoscopic.
    """
    image.check_orthoscopic()
    layout = image.layout
    if len(depths_mm) < 3:
        raise LayoutError(f"expected at least three depths to choose from, got {len(depths_mm)}")
    wanted = tone(image, number)
    others = [(u, v) for u, v in view_numbers(layout) if 0 < max(abs(u - number[0]), abs(v - number[1])) <= reach]
    if not others:
        raise LayoutError(f"expected views beside view {number} of {layout}, got none within {reach}")
    pictures = {other: splines(tone(image, other)) for other in others}
    costs = np.empty((len(depths_mm), *wanted.shape[:2]), dtype=np.float32)
    for index, depth_mm in enumerate(depths_mm):
        down, across = shifts(layout, depth_mm, focal_mm=image.focal_length_mm)
        unlike = [
            _smooth(_difference(wanted, picture, -down * (v - number[1]), -across * (u - number[0])), window_px)
            for (u, v), picture in pictures.items()
        ]
        costs[index] = _better_half(np.stack(unlike))
    return _lowest(costs, np.asarray(depths_mm, dtype=np.float64))


def sweep_depths(
    layout: CellLayout, nearest_mm: float, farthest_mm: float, *, focal_mm: float, reach: int = REACH
) -> tuple[float, ...]:
    """Return the depths of a sweep, mm, rising from the farthest to the nearest; see `STEP` for their distance.

    Parameters
    ----------
    layout
        The lenses over the sheet.
    nearest_mm, farthest_mm
        The ends of the range, mm in front of the display.
    focal_mm
        The focal length of the lenses, mm.
    reach
        The views to each side that are compared.

    Examples
    --------
    >>> sweep_depths(CellLayout(9, 9, 8), 6.6, 0.0, focal_mm=3.3)
    (0.0, 3.3, 6.6)
    """
    step_mm = STEP / reach * layout.px_per_lens * focal_mm
    count = max(2, math.ceil((nearest_mm - farthest_mm) / step_mm - 1e-9))
    return tuple(float(depth) for depth in np.linspace(farthest_mm, nearest_mm, count + 1))


def tone(image: IntegralImage, number: tuple[int, int]) -> NDArray[np.floating[Any]]:
    """Return the square root of a view on square pixels, so that differences in the dark count as those in light.

    Parameters
    ----------
    image
        An orthoscopic image.
    number
        The view, (u, v).

    Returns
    -------
    NDArray
        `(row, col, channel)`, 0 to 1.
    """
    seen: NDArray[np.floating[Any]] = np.sqrt(
        np.clip(as_square(working(view(image.pixels, image.layout, *number)), image.layout), 0, 1)
    )
    return seen


def splines(picture: Picture) -> Picture:
    """Return the cubic splines through a picture's pixels, `(channel, row, col)`."""
    from scipy.ndimage import spline_filter

    channels = np.moveaxis(picture, -1, 0)
    filtered: Picture = np.stack([spline_filter(channel, order=3, output=np.float32) for channel in channels])
    return filtered


def moved(splined: Picture, *, down: float = 0.0, across: float = 0.0) -> Picture:
    """Sample a picture at every pixel's place plus an offset.

    Parameters
    ----------
    splined
        `(channel, row, col)`, as `splines` returns it.
    down, across
        The offset, px.

    Returns
    -------
    NDArray
        `(channel, row, col)`; beyond the border the outermost pixels go on.
    """
    from scipy.ndimage import shift

    by = (-down, -across)
    shifted: Picture = np.stack([shift(channel, by, order=3, prefilter=False, mode="nearest") for channel in splined])
    return shifted


def _difference(wanted: Picture, splined: Picture, down: float, across: float) -> Map:
    """Return by how much a view differs, moved against its shift; NaN where the other view does not reach."""
    rows, cols = wanted.shape[:2]
    apart = np.abs(moved(splined, down=down, across=across) - np.moveaxis(wanted, -1, 0))
    unlike: Map = np.minimum(apart.mean(axis=0), UNLIKE).astype(np.float32)
    at_row, at_col = np.arange(rows) + down, np.arange(cols) + across
    unlike[(at_row < 0) | (at_row > rows - 1)] = np.nan
    unlike[:, (at_col < 0) | (at_col > cols - 1)] = np.nan
    return unlike


def _smooth(unlike: Map, half: int) -> Map:
    """Return the mean over a square of 2 half + 1 of what there is; NaN stays NaN."""
    there = np.isfinite(unlike)
    total = _box(np.where(there, unlike, 0).astype(np.float32), half) / np.maximum(
        _box(there.astype(np.float32), half), 1
    )
    return np.where(there, total, np.nan).astype(np.float32)


def _box(values: Map, half: int) -> Map:
    from scipy.ndimage import uniform_filter

    side = 2 * half + 1
    summed: Map = uniform_filter(values, side, mode="constant") * np.float32(side * side)
    return summed


def _better_half(unlike: NDArray[np.float32]) -> Map:
    """Return the mean of the better half of the views at every pixel, of those that reach there; NaN without any."""
    order = np.sort(unlike, axis=0)  # NaN come last
    count = np.isfinite(order).sum(axis=0)
    taken = np.arange(len(order))[:, np.newaxis, np.newaxis] < np.ceil(count / 2)
    total = np.where(taken, order, 0).sum(axis=0)
    return np.where(count > 0, total / np.maximum(np.ceil(count / 2), 1), np.nan).astype(np.float32)


def _lowest(costs: NDArray[np.float32], depths_mm: NDArray[np.float64]) -> DepthEstimate:
    """Return where costs `(depth, row, col)` are lowest.

    Between depths it is where two lines meet that rise to both sides as steeply as to the steeper one: costs are
    absolute differences, and so are their valleys.
    """
    known = np.where(np.isfinite(costs), costs, UNLIKE)
    best = np.clip(known.argmin(axis=0), 1, len(depths_mm) - 2)
    before, here, after = (np.take_along_axis(known, (best + k)[np.newaxis], axis=0)[0] for k in (-1, 0, 1))
    steeper = np.maximum(before, after) - here
    part = np.where(steeper > 0, 0.5 * (before - after) / np.where(steeper > 0, steeper, 1), 0)
    depth = depths_mm[best] + np.clip(part, -1, 1) * (depths_mm[1] - depths_mm[0])
    mean = known.mean(axis=0)
    lowest = known.min(axis=0)
    confidence = np.where(mean > 0, 1 - lowest / np.where(mean > 0, mean, 1), 0)
    return DepthEstimate(depth.astype(np.float32), confidence.astype(np.float32))
