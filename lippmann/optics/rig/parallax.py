"""Parallax by exact rays: the shift over the lenses from one view to the next, pixel by pixel.

A pixel at the offset h from the axis of the lens at L sees the point F(L, h) of the plane z. Other pixels see the same
point along a curve L(h) with dF = 0, so that dL/dh = -(dF/dL)^-1 dF/dh. The columns of the two 2 x 2 matrices are
differences of exact rays, for L and h half a pixel to either side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.rig import Rig
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import Bench, camera_rays, through_microlens
from lippmann.optics.rig.disparity import seen_under

Array = NDArray[np.float64]


def parallax(bench: Bench, points_mm: Array, z_mm: Array) -> Array:
    """Return the shift per view of the point that each pixel shows, in lens pitches, as (across, down).

    A positive shift is opposite to the motion of the eye: to the left as the eye moves to the right, and up as it moves
    down, in the orthoscopic integral image. The paraxial value is (s + f) / (n f): see docs/optics.md, Depth.

    Parameters
    ----------
    bench
        The bench of the rig.
    points_mm
        The centres of the pixels on the plane of the array, float64 (..., 2), mm; see `pixel_centres_mm`.
    z_mm
        The z at which the ray of each pixel meets the scene, float64 (...), mm; NaN where it does not.

    Returns
    -------
    NDArray
        float64 (..., 2); NaN where z is NaN, and where a ray passes beside the glass of the array.
    """
    centre, offset = _under_glass(bench, points_mm)
    step = np.array(lattice.pixel_mm(bench.rig))
    of_lens, of_place = np.empty((*z_mm.shape, 2, 2)), np.empty((*z_mm.shape, 2, 2))
    for axis in range(2):
        half = np.where(np.arange(2) == axis, step / 2, 0.0)
        for matrix, lens, place in ((of_lens, half, 0.0), (of_place, 0.0, half)):
            ahead = seen_under(bench, centre + lens, offset + place).at_z(z_mm)[..., :2]
            behind = seen_under(bench, centre - lens, offset - place).at_z(z_mm)[..., :2]
            matrix[..., axis] = (ahead - behind) / step[axis]
    moves: Array = -_own_terms(of_lens, of_place) * step / bench.rig.lens_array.pitch_mm
    return moves


def depth_on_display_mm(parallaxes: Array, rig: Rig) -> Array:
    """Return the depth on the display of points with a parallax, mm.

    Parameters
    ----------
    parallaxes
        The parallaxes, float64 (..., 2), see `parallax`; the mean of both directions counts.
    rig
        The rig. On its display the array is one focal length f before the pixels, and a point that shifts by s / (n f)
        appears at the depth s.
    """
    array = rig.lens_array
    pixel_pitches = np.array(lattice.pixel_mm(rig)) / array.pitch_mm
    shown: Array = array.focal_length_mm * (parallaxes / pixel_pitches).mean(axis=-1)
    return shown


def _own_terms(of_lens: Array, of_place: Array) -> Array:
    """Return the diagonal of dL/dh = -(dF/dL)^-1 dF/dh, (..., 2); NaN where the rays do not determine it."""
    determinant = of_lens[..., 0, 0] * of_lens[..., 1, 1] - of_lens[..., 0, 1] * of_lens[..., 1, 0]
    across = of_lens[..., 1, 1] * of_place[..., 0, 0] - of_lens[..., 0, 1] * of_place[..., 1, 0]
    down = of_lens[..., 0, 0] * of_place[..., 1, 1] - of_lens[..., 1, 0] * of_place[..., 0, 1]
    with np.errstate(divide="ignore", invalid="ignore"):
        found: Array = -np.stack((across, down), axis=-1) / determinant[..., np.newaxis]
    found[~np.isfinite(found)] = np.nan
    return found


def _under_glass(bench: Bench, points_mm: Array) -> tuple[Array, Array]:
    """Return the lens over every pixel and the offset from its axis, each (..., 2); NaN beside the glass."""
    array = bench.rig.lens_array
    rays = camera_rays(bench, points_mm)
    met = rays.at_z(bench.mla_z_mm + bench.microlens.thickness_mm)[..., :2]
    centre = lattice.nearest_centre_mm(array, met)
    _, convex_z_mm = through_microlens(rays, bench, centre)
    glass = (convex_z_mm >= bench.mla_z_mm) & lattice.inside_cell(array, met - centre)
    offset = np.where(glass[..., np.newaxis], points_mm - centre, np.nan)
    return centre, offset
