"""Depths at which to focus: those of a scene, or estimated between neighbouring views, as depths of refocused pictures.

`capture.depth` stores the places of surfaces in the scene, and an estimate is the parallax of a few views. A refocused
picture mixes all views, and with an imaging lens it is sharp at another depth (`optics.rig.sharp_depth`). That depth is
tabulated over the distance of the point and over the distance of its lens from the axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.rig import Rig
from lippmann.job.scenes.stage import Stage
from lippmann.lattice.layout import CellLayout
from lippmann.optics.rig.bench import Bench, bench
from lippmann.optics.rig.disparity import seen_under
from lippmann.optics.rig.sharp_depth import sharp_depth_mm, view_offset_mm, view_offsets_mm
from lippmann.plan.sampling import display_size

RADII = 9
"""The number of distances from the axis in the table."""
DISTANCES = 33
"""The number of distances of points in the table, evenly spaced in 1 / distance."""
DIRECTION = (math.cos(math.pi / 8), math.sin(math.pi / 8))
"""The direction of the lenses of the table from the axis, between that of a row and that of a diagonal."""
NEAREST = 0.4
"""The nearest point of the table for estimates, in distances of the nearest plane of the stage."""

Array = NDArray[np.float64]
Map = NDArray[np.float32]


@dataclass(frozen=True)
class View:
    """A view, and the optics that captured it."""

    bench: Bench
    layout: CellLayout
    number: tuple[int, int]
    """(u, v)."""


def view_of(rig: Rig, stage: Stage, number: tuple[int, int]) -> View:
    """Return a view of a rig before a scene.

    Raises
    ------
    OpticsError, SpecError
        If the rig cannot be built.
    """
    return View(bench(rig, reference_mm=stage.reference_mm), display_size(rig), number)


def focus_of_scene(view: View, z_mm: Map) -> Map:
    """Return the depths at which the surfaces of a view are sharp in the refocused picture.

    Parameters
    ----------
    view
        The view.
    z_mm
        The distance of the surface that each pixel shows from the origin of the rig, `(row, col)` of square pixels, mm;
        NaN elsewhere.

    Returns
    -------
    NDArray
        `(row, col)`, mm in front of the display; NaN where z is NaN.
    """
    known = z_mm[np.isfinite(z_mm) & (z_mm > 0)]
    if not known.size:
        return np.full_like(z_mm, np.nan)
    radii = _radii(view)
    near, far = 1 / float(known.min()), 1 / float(known.max())
    inverse = np.linspace(far, max(near, far * (1 + 1e-6)), DISTANCES)
    table = sharp_depth_mm(view.bench, _points(view, radii, 1 / inverse), _all(view))
    with np.errstate(divide="ignore", invalid="ignore"):
        at = (1 / z_mm.astype(np.float64) - inverse[0]) / (inverse[1] - inverse[0])
    return _bilinear(table, _radius_map(view) / (radii[1] - radii[0]), at).astype(np.float32)


def focus_of_point(view: View, place: tuple[int, int], z_mm: float) -> float | None:
    """Return the depth at which the refocused picture shows the surface that one pixel shows, mm; None without one.

    Parameters
    ----------
    view
        The view.
    place
        (row, col) of square pixels.
    z_mm
        The distance of the surface from the origin of the rig, mm.
    """
    if not (math.isfinite(z_mm) and z_mm > 0):
        return None
    rows, cols = view.layout.square_size()
    pitch_mm = view.bench.rig.lens_array.pitch_mm
    upright = _upright(view.bench)
    lens_mm = np.array([place[1] - (cols - 1) / 2, (rows - 1) / 2 - place[0]]) * pitch_mm * upright
    found = float(sharp_depth_mm(view.bench, _seen(view, lens_mm, np.array(z_mm)), _all(view)))
    return found if math.isfinite(found) else None


def focus_of_estimate(view: View, stage: Stage, s_mm: Map, *, reach: int) -> Map:
    """Return the depths at which the surfaces of a view are sharp, from depths that its neighbours show.

    Parameters
    ----------
    view
        The view.
    stage
        The stage of the scene.
    s_mm
        The depth from the parallax of the views of the same row and column, `(row, col)`, mm; NaN where it is unknown.
    reach
        The number of views to either side that the estimate compares.

    Returns
    -------
    NDArray
        `(row, col)`, mm in front of the display; NaN where it is unknown.
    """
    radii = _radii(view)
    inverse = np.linspace(0, 1 / (NEAREST * stage.near_mm), DISTANCES)
    inverse[0] = inverse[1] / 1000
    points = _points(view, radii, 1 / inverse)
    local, whole = (sharp_depth_mm(view.bench, points, offsets) for offsets in (_near(view, reach), _all(view)))
    by_radius = np.empty((len(radii), *s_mm.shape))
    for index, (from_mm, to_mm) in enumerate(zip(local, whole, strict=True)):
        order = np.argsort(from_mm)
        order = order[np.isfinite(from_mm[order]) & np.isfinite(to_mm[order])]
        by_radius[index] = s_mm
        if order.size:
            by_radius[index] += np.interp(s_mm, from_mm[order], (to_mm - from_mm)[order])
    return _linear(by_radius, _radius_map(view) / (radii[1] - radii[0])).astype(np.float32)


def _upright(here: Bench) -> float:
    """Return -1 if the conversion to an orthoscopic image turns the array of the capture, by an imaging lens."""
    return -1.0 if here.imaging_lens is not None else 1.0


def _all(view: View) -> Array:
    return view_offsets_mm(view.bench.rig, view.layout)


def _near(view: View, reach: int) -> Array:
    """Return the offsets of the views of the same row and column that an estimate compares."""
    u, v = view.number
    steps = range(-reach, reach + 1)
    near = {(u + step, v) for step in steps} | {(u, v + step) for step in steps}
    numbers = sorted(number for number in near if view.layout.has_view(*number))
    return np.array([view_offset_mm(view.bench.rig, view.layout, *number) for number in numbers])


def _radii(view: View) -> Array:
    rows, cols = view.layout.square_size()
    most = math.hypot((rows - 1) / 2, (cols - 1) / 2) * view.bench.rig.lens_array.pitch_mm
    return np.linspace(0, max(most, 1e-6), RADII)


def _radius_map(view: View) -> Array:
    """Return the distance of the lens of each square pixel from the axis, `(row, col)`, mm."""
    rows, cols = view.layout.square_size()
    down, across = np.arange(rows) - (rows - 1) / 2, np.arange(cols) - (cols - 1) / 2
    radius: Array = np.hypot(down[:, np.newaxis], across) * view.bench.rig.lens_array.pitch_mm
    return radius


def _points(view: View, radii_mm: Array, z_mm: Array) -> Array:
    """Return the points that the view shows under lenses off the axis, `(radius, distance, 3)`, mm."""
    lens_mm = radii_mm[:, np.newaxis, np.newaxis] * np.array(DIRECTION)
    shape = (len(radii_mm), len(z_mm))
    return _seen(view, np.broadcast_to(lens_mm, (*shape, 2)), np.broadcast_to(z_mm, shape))


def _seen(view: View, lens_mm: Array, z_mm: Array) -> Array:
    offset = np.broadcast_to(view_offset_mm(view.bench.rig, view.layout, *view.number), lens_mm.shape)
    return np.asarray(seen_under(view.bench, lens_mm, offset).at_z(-z_mm))


def _bilinear(table: Array, row: Array, col: Array) -> Array:
    """Return a table (row, col) at fractional places; NaN at places that are NaN."""
    known = np.isfinite(col)
    col = np.clip(np.where(known, col, 0.0), 0, table.shape[1] - 1)
    left = np.minimum(col.astype(np.intp), table.shape[1] - 2)
    share = col - left
    above = np.minimum(row.astype(np.intp), table.shape[0] - 2)
    low, high = (table[above + k, left] * (1 - share) + table[above + k, left + 1] * share for k in (0, 1))
    found: Array = np.where(known, low + (high - low) * (row - above), np.nan)
    return found


def _linear(layers: Array, at: Array) -> Array:
    """Return layers `(layer, row, col)` at fractional layers `(row, col)`."""
    below = np.minimum(at.astype(np.intp), len(layers) - 2)
    low, high = (np.take_along_axis(layers, (below + k)[np.newaxis], axis=0)[0] for k in (0, 1))
    found: Array = low + (high - low) * (at - below)
    return found
