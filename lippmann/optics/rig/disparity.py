"""Disparity: the shift of a point over the lenses from one view to the next, paraxial and by exact rays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.trace import Rays, through_lens
from lippmann.optics.rig.bench import Bench, camera_rays, through_microlens

MAX_VIEWS = 32
"""The greatest number of views in a row that are traced, evenly spaced among all."""
STEPS = 40
"""The most steps of the secant method, which ends when the result is constant."""
CLOSE_MM = 1e-10


def small_angle_disparity(bench: Bench, object_mm: float) -> float:
    """Return the shift in lenses per view, (s + f) / (n f); see docs/optics.md, Depth.

    Parameters
    ----------
    bench
        The bench of the rig.
    object_mm
        The distance of the object plane before the origin, surface 1 of the imaging lens, mm.
    """
    focal_mm = bench.rig.lens_array.focal_length_mm
    return (bench.s_mm(object_mm) + focal_mm) / (bench.rig.px_per_lens * focal_mm)


def exact_disparity(bench: Bench, object_mm: float) -> float | None:
    """Return the shift in lenses per view by exact rays; None if no ray comes from the axis point.

    For each pixel in a row of a cell, the position of a lens is found whose pixel sees the axis point of the object
    plane. The result is the least-squares slope of that position over the view; views count from the right of a cell.

    Parameters
    ----------
    bench
        The bench of the rig.
    object_mm
        The distance of the object plane before the origin, surface 1 of the imaging lens, mm.
    """
    n, array = bench.rig.px_per_lens, bench.rig.lens_array
    pixel = np.unique(np.linspace(0, n - 1, min(n, MAX_VIEWS)).round())
    offset_mm = (pixel + 0.5 - n / 2) * array.pitch_mm / n
    lens_x_mm = _lens_places(bench, object_mm, offset_mm)
    if lens_x_mm is None:
        return None
    return -float(np.polyfit(pixel, lens_x_mm / array.pitch_mm, 1)[0])


def _lens_places(bench: Bench, object_mm: float, offset_mm: NDArray[np.float64]) -> NDArray[np.float64] | None:
    here = np.zeros_like(offset_mm)
    there = here + bench.rig.lens_array.pitch_mm
    miss = _height_mm(bench, object_mm, here, offset_mm)
    for _ in range(STEPS):
        next_miss = _height_mm(bench, object_mm, there, offset_mm)
        rise = next_miss - miss
        if not np.all(np.isfinite(rise)):
            return None
        step = np.where(rise == 0, 0.0, -next_miss * (there - here) / np.where(rise == 0, 1.0, rise))
        here, there, miss = there, there + step, next_miss
        if np.max(np.abs(step)) < CLOSE_MM:
            return there
    return None


def _height_mm(
    bench: Bench, object_mm: float, lens_x_mm: NDArray[np.float64], offset_mm: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the heights at which pixels see the object plane under lenses at any position, with apertures open."""
    flat = np.zeros_like(offset_mm)
    centre, offset = np.stack((lens_x_mm, flat), axis=-1), np.stack((offset_mm, flat), axis=-1)
    return np.asarray(seen_under(bench, centre, offset).at_z(-object_mm)[..., 0])


def seen_under(bench: Bench, centre_mm: NDArray[np.float64], offset_mm: NDArray[np.float64]) -> Rays:
    """Return the rays in the scene's space that the camera sees under lenses at any position, with apertures open.

    Parameters
    ----------
    bench
        The bench of the rig.
    centre_mm
        The centres of the lenses, float64 (..., 2), mm as (x, y).
    offset_mm
        The offsets from the centre of the lens to the intersection of the camera ray with the plane of the array,
        float64 (..., 2), mm as (x, y).
    """
    rays, _ = through_microlens(camera_rays(bench, centre_mm + offset_mm), bench, centre_mm)
    if bench.imaging_lens is None:
        return rays
    return through_lens(rays, bench.imaging_lens, backward=True, stopped=False)
