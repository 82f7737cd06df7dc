"""The depth at which a refocused picture shows a point sharpest, by exact rays.

Each view shows a point under a lens of its own, and refocusing moves the view by f times the offset of its pixel in the
cell, over the depth. The depth that fits all views best, by least squares, is the depth of the sharpest picture. With
spherical aberration it differs from the paraxial depth, and from the parallax of neighbouring views, by millimetres.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.rig import Rig
from lippmann.lattice.layout import CellLayout
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import Bench
from lippmann.optics.rig.disparity import seen_under

Array = NDArray[np.float64]

MAX_VIEWS = 8
"""The greatest number of views in a row that are traced, evenly spaced among all."""
STEPS = 40
"""The most steps of the secant method, which ends when the result is constant."""
CLOSE_MM = 1e-7


def sharp_depth_mm(bench: Bench, points_mm: Array, offsets_mm: Array) -> Array:
    """Return the depth on the display that fits points best in some views.

    Parameters
    ----------
    bench
        The bench of the rig.
    points_mm
        The points in the rig frame, float64 (..., 3), mm.
    offsets_mm
        The offsets of the pixels of the views from the axes of their lenses, float64 (view, 2), mm as (x, y); see
        `view_offsets_mm`.

    Returns
    -------
    NDArray
        float64 (...), mm in front of a display whose array is one focal length f in front of its pixels; NaN for a
        point that some view cannot show.
    """
    lenses_mm = _lens_places(bench, points_mm, offsets_mm)
    turned = offsets_mm - offsets_mm.mean(axis=0)
    moves = np.sum((lenses_mm - lenses_mm.mean(axis=-2, keepdims=True)) * turned, axis=(-2, -1))
    found: Array = -bench.rig.lens_array.focal_length_mm * moves / np.sum(turned**2)
    return found


def view_offsets_mm(rig: Rig, layout: CellLayout) -> Array:
    """Return the offsets in the cell at which the capture records the views, at most `MAX_VIEWS` in a row.

    Parameters
    ----------
    rig
        The rig.
    layout
        The layout of the orthoscopic integral image.

    Returns
    -------
    NDArray
        float64 (view, 2), mm as (x, y).
    """
    us, vs = _spread(layout.cell_cols), _spread(layout.cell_rows)
    return np.array([view_offset_mm(rig, layout, u, v) for v in vs for u in us if layout.has_view(u, v)])


def view_offset_mm(rig: Rig, layout: CellLayout, u: int, v: int) -> tuple[float, float]:
    """Return the offset (x, y) in its cell at which the capture records a view, mm.

    Parameters
    ----------
    rig
        The rig.
    layout
        The layout of the orthoscopic integral image.
    u, v
        The view.
    """
    width_mm, height_mm = lattice.pixel_mm(rig)
    across, down = u - (layout.cell_cols - 1) / 2, v - (layout.cell_rows - 1) / 2
    # The conversion turns the cells of a direct pickup, and with an imaging lens it leaves them as captured.
    sign = -1.0 if rig.imaging_lens is not None else 1.0
    return sign * across * width_mm, -sign * down * height_mm


def _spread(count: int) -> list[int]:
    """Return the middles of even parts of all numbers, so that the outermost ones do not count too much."""
    chosen = min(count, MAX_VIEWS)
    return [(2 * part + 1) * count // (2 * chosen) for part in range(chosen)]


def _lens_places(bench: Bench, points_mm: Array, offsets_mm: Array) -> Array:
    """Return the positions of lenses (..., view, 2) whose pixels at the offsets see the points; NaN where none does."""
    shape = (*points_mm.shape[:-1], *offsets_mm.shape)
    offset, z_mm = np.broadcast_to(offsets_mm, shape), np.broadcast_to(points_mm[..., np.newaxis, 2], shape[:-1])
    wanted = points_mm[..., np.newaxis, :2]

    def miss_at(lens_mm: Array) -> Array:
        return np.asarray(seen_under(bench, lens_mm, offset).at_z(z_mm)[..., :2]) - wanted

    here, there = np.zeros(shape), np.full(shape, bench.rig.lens_array.pitch_mm)
    miss = miss_at(here)
    for _ in range(STEPS):
        next_miss = miss_at(there)
        rise = next_miss - miss
        # The two directions hardly depend on each other, so that each has a secant of its own.
        step = np.where(rise == 0, 0.0, -next_miss * (there - here) / np.where(rise == 0, 1.0, rise))
        here, there, miss = there, there + step, next_miss
        if not np.any(np.abs(step) > CLOSE_MM):
            return there
    return np.where(np.abs(step) > CLOSE_MM, np.nan, there)
