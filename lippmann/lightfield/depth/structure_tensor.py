"""Depth estimation by the structure tensor: the slopes of lines in epipolar images.

A row of views, one above the other, is an epipolar image: a point draws a line in it whose slope is its disparity. The
structure tensor finds the direction of lines and how much like lines things are, its coherence (Wanner, Goldluecke,
*Variational light field analysis for disparity estimation and super-resolution*, IEEE Trans. Pattern Analysis and
Machine Intelligence 36(3), 2014). Steep lines fall apart into dots; so the views are moved against each other first by
depth after depth, as for refocus, and the most coherent of all small remaining slopes counts (Diebold, Goldluecke,
*Epipolar plane image refocusing for improved depth estimation and occlusion handling*, VMV 2013), of rows of views from
left to right or from top to bottom.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.plane_sweep import REACH, DepthEstimate, Map, Picture, moved, splines, tone
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.refocus.shift_and_sum import shifts
from lippmann.lightfield.views.views import view_numbers

SMOOTH_PX = 1.2
"""Over how much of a view the tensor is averaged: standard deviation."""

DOWN, ACROSS = 0, 1
"""Axes of a view, `(row, col)`."""

NEAR_PX = 0.25
"""Apart from a pixel to either side a spline's slope is taken: between whole pixels fine patterns look too flat."""

STEEPEST = 1.0
"""Remaining disparity beyond which a slope is not believed, in pitches."""


def structure_tensor(
    image: IntegralImage,
    number: tuple[int, int],
    depths_mm: Sequence[float],
    *,
    reach: int = REACH,
) -> DepthEstimate:
    """Estimate the depth of a view by the structure tensor of its epipolar images; see the module.

    Parameters
    ----------
    image, number, reach
        As in `plane_sweep`.
    depths_mm
        The depths s by which the views are moved, mm in front of the display; at most a pitch a view from one to the
        next.

    Returns
    -------
    DepthEstimate
        The depth; its confidence is the coherence.

    Raises
    ------
    LayoutError
        If there is no such view, no view lies beside it on either side, or the image is pseudoscopic.
    """
    image.check_orthoscopic()
    layout = image.layout
    size = tone(image, number).shape[:2]
    s_mm, confidence = np.zeros(size), np.zeros(size)
    lines = {axis: _line(layout, number, reach, axis=axis) for axis in (DOWN, ACROSS)}
    if not any(lines.values()):
        raise LayoutError(f"expected views on both sides of view {number} of {layout}, got none")
    for axis, line in lines.items():
        views = {k: splines(tone(image, there)) for k, there in line.items()}
        per_mm = shifts(layout, 1.0, focal_mm=image.focal_length_mm)[axis]
        if not views:
            continue
        for depth_mm in depths_mm:
            slope, coherence = _slope(views, -depth_mm * per_mm, axis=axis)
            better = (coherence > confidence) & (np.abs(slope) <= STEEPEST)
            s_mm[better] = (depth_mm + slope / per_mm)[better]
            confidence[better] = coherence[better]
    return DepthEstimate(s_mm.astype(np.float32), confidence.astype(np.float32))


def _line(layout: CellLayout, number: tuple[int, int], reach: int, *, axis: int) -> dict[int, tuple[int, int]]:
    """Return the views in a line with one, by how far they are off, itself at 0; none if it is the last of its line."""
    u, v = number
    line = {k: (u, v + k) if axis == DOWN else (u + k, v) for k in range(-reach, reach + 1)}
    there = {k: other for k, other in line.items() if other in set(view_numbers(layout))}
    return there if -1 in there and 1 in there else {}


def _slope(views: Mapping[int, Picture], shift: float, *, axis: int) -> tuple[Map, Map]:
    """Return the disparity that remains and its coherence, each `(row, col)`."""
    from scipy.ndimage import gaussian_filter

    way = {DOWN: "down", ACROSS: "across"}[axis]
    pictures = {k: moved(splined, **{way: shift * k}) for k, splined in views.items()}
    weight = {k: np.exp(-(k**2) / 2.0) for k in pictures}
    total = sum(weight.values())
    mean = sum(weight[k] * pictures[k] for k in pictures) / total
    # The slope over the views, by weighted least squares: k counts from the view itself.
    middle = sum(weight[k] * k for k in pictures) / total
    spread = sum(weight[k] * (k - middle) ** 2 for k in pictures)
    over_views = sum(weight[k] * (k - middle) * pictures[k] for k in pictures) / spread
    splined = splines(np.moveaxis(mean, 0, -1))
    over_px = (moved(splined, **{way: NEAR_PX}) - moved(splined, **{way: -NEAR_PX})) / (2 * NEAR_PX)
    smooth = [
        gaussian_filter(product.mean(axis=0), SMOOTH_PX)
        for product in (over_px * over_px, over_px * over_views, over_views * over_views)
    ]
    along, mixed, across = smooth
    strength = along + across
    apart = np.hypot(along - across, 2 * mixed)
    coherence = np.where(strength > 1e-9, apart / np.maximum(strength, 1e-9), 0)
    return np.tan(0.5 * np.arctan2(2 * mixed, along - across)), coherence
