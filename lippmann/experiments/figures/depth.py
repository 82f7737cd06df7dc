"""Measure depth in the views, from the shift of a patch over the lenses from view to view.

A point at depth s in front of the array of the capture shifts by (s + f) / (n f) lenses from one view to the next, to
the left as the eye moves right, because rays parallel to the axis meet in the front focal plane of each lens
(docs/optics.md, Depth).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Patch:
    """A rectangle of the central view, in lenses."""

    lens_row: float
    lens_col: float
    """The column of its centre; fractions lie between lenses."""
    half_rows: int
    half_cols: int


@dataclass(frozen=True)
class Movement:
    """The shift of a patch from view to view."""

    lenses_a_view: float
    """The shift to the left, in lenses, as the eye moves right by one view."""
    likeness: float
    """The mean correlation of the shifted patches with their mean; 1 if every view shows the same patch."""


def movement(views: Array, patch: Patch, candidates: Array) -> Movement | None:
    """Estimate the shift of a patch from view to view.

    For every candidate the patch is taken from each view at its shifted position and compared with the mean of all
    views; the best candidate is refined with a parabola.

    Parameters
    ----------
    views
        The luminance of one row of views, `(view, lens_row, lens_col)`, from the leftmost eye to the rightmost. The
        position of the patch is the one half-way between the two central views.
    patch
        The patch to follow.
    candidates
        The shifts to try, evenly spaced, lenses a view.

    Returns
    -------
    Movement or None
        None if the patch is outside the picture.
    """
    strip = _rows(views, patch)
    if strip is None:
        return None
    unlike = np.array([_unlikeness(strip, patch, candidate) for candidate in candidates])
    if not np.isfinite(unlike).any():
        return None
    best = int(np.nanargmin(unlike))
    refined = candidates[best] + _to_vertex(unlike, best) * (candidates[1] - candidates[0])
    return Movement(float(refined), float(1 - unlike[best]))


def depth_mm(lenses_a_view: float, *, px_per_lens: int, focal_length_mm: float) -> float:
    """Return the signed distance s of an image from the array of the capture, mm, positive toward the observer.

    >>> depth_mm((40 + 3.3) / (24 * 3.3), px_per_lens=24, focal_length_mm=3.3)
    40.0
    """
    return round(lenses_a_view * px_per_lens * focal_length_mm - focal_length_mm, 9)


def lenses_a_view(s_mm: float, *, px_per_lens: int, focal_length_mm: float) -> float:
    """Return the shift of a point at depth s from view to view, lenses; the inverse of `depth_mm`."""
    return (s_mm + focal_length_mm) / (px_per_lens * focal_length_mm)


def _rows(views: Array, patch: Patch) -> Array | None:
    """Return the rows of the patch in all views, `(view, row, lens_col)`, interpolated between lens rows."""
    first = patch.lens_row + np.arange(-patch.half_rows, patch.half_rows + 1)
    if first[0] < 0 or first[-1] > views.shape[1] - 1:
        return None
    above = np.minimum(first.astype(int), views.shape[1] - 2)
    part = (first - above)[:, np.newaxis]
    taken: Array = views[:, above] * (1 - part) + views[:, above + 1] * part
    return taken


def _unlikeness(strip: Array, patch: Patch, candidate: float) -> float:
    """Return the fraction of the variance that is not common to all views; NaN if too few views show the patch."""
    count, _, width = strip.shape
    shift = -candidate * (np.arange(count) - (count - 1) / 2)
    at = patch.lens_col + shift[:, np.newaxis] + np.arange(-patch.half_cols, patch.half_cols + 1)
    inside = (at >= 0).all(axis=1) & (at <= width - 1).all(axis=1)
    if inside.sum() < max(2, count // 2):
        return float("nan")
    left = np.minimum(at[inside].astype(int), width - 2)[:, np.newaxis, :]
    part = at[inside][:, np.newaxis, :] - left
    of_view = np.nonzero(inside)[0][:, np.newaxis, np.newaxis]
    row = np.arange(strip.shape[1])[np.newaxis, :, np.newaxis]
    moved = strip[of_view, row, left] * (1 - part) + strip[of_view, row, left + 1] * part
    # The patch of every view has the same weight, however bright it is.
    moved = moved - moved.mean(axis=(1, 2), keepdims=True)
    energy = (moved**2).mean()
    return float(((moved - moved.mean(axis=0)) ** 2).mean() / energy) if energy > 0 else float("nan")


def _to_vertex(values: Array, at: int) -> float:
    """Return the distance of the vertex of the parabola through three values from the middle one, in steps."""
    if not 0 < at < len(values) - 1 or not np.isfinite(values[at - 1 : at + 2]).all():
        return 0.0
    before, here, after = values[at - 1 : at + 2]
    bend = before - 2 * here + after
    return float(np.clip((before - after) / (2 * bend), -0.5, 0.5)) if bend > 0 else 0.0
