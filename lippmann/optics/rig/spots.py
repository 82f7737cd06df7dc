"""Best focus, spot and height of the image of a point, by the exact trace.

Only the rays of a point that reach a pixel count: they pass the apertures of the imaging lens, meet the array inside
its edge, and are not so steep that they reach the cell of another lens. A camera ray at the in-lens offset h has the
slope -h / f behind the lens, so the array takes a cone of the form of its cell, as wide as its own f-number.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.trace import Rays, through_lens, unit
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import Bench

AIMED = 31
"""The number of rays across the aperture in each direction; spots change by less than 1 % with more."""
LOOKS = 3
"""The number of times that the rays are aimed again, at the part of the aperture that counts."""
ENOUGH = 9
"""The least number of rays of a spot."""
FAN = 101
"""The number of rays of a fan in one plane."""


@dataclass(frozen=True)
class Focus:
    """The image of a point."""

    image_mm: float
    """The distance of the image plane behind the last vertex of the imaging lens."""
    rms_mm: float
    """The root mean square distance of the rays from their centroid."""
    height_mm: float
    """The height of the centroid above the axis."""


def best_focus(bench: Bench, object_mm: float) -> Focus | None:
    """Return the image of the axis point of an object plane where its spot is smallest; None if no light arrives.

    The plane minimises the sum of the squared distances. Because the views of a capture sample slopes evenly, it is
    also the depth that fits all views best.

    Parameters
    ----------
    bench
        The bench of the rig.
    object_mm
        The distance of the object plane before the origin, surface 1 of the imaging lens, mm.
    """
    used = used_rays(bench, object_mm=object_mm, height_mm=0.0)
    if used is None:
        return None
    at_end = used.at_z(bench.lens_end_mm)[:, :2]
    slope = used.direction[:, :2] / used.direction[:, 2:]
    away, turned = at_end - at_end.mean(axis=0), slope - slope.mean(axis=0)
    return spot(used, bench, image_mm=-float(np.sum(away * turned) / np.sum(turned**2)))


def focus_at(bench: Bench, object_mm: float, *, height_mm: float, image_mm: float) -> Focus | None:
    """Return the image of a point beside the axis on a given plane; None if no light arrives.

    Parameters
    ----------
    bench
        The bench of the rig.
    object_mm
        The distance of the object plane before the origin, surface 1 of the imaging lens, mm.
    height_mm
        The height of the point above the axis, mm.
    image_mm
        The place of the image plane behind the last vertex, mm.
    """
    used = used_rays(bench, object_mm=object_mm, height_mm=height_mm)
    return None if used is None else spot(used, bench, image_mm=image_mm)


def working_f_number(bench: Bench, object_mm: float) -> float | None:
    """Return the f-number of the whole cone in the image of an axis point: 1 / (2 x the steepest slope).

    Parameters
    ----------
    bench
        The bench of the rig.
    object_mm
        The distance of the object plane before the origin, surface 1 of the imaging lens, mm.
    """
    lens = bench.imaging_lens
    if lens is None:
        return None
    point, steepest = np.array([0.0, 0.0, -object_mm]), 0.0
    low_mm, high_mm = 0.0, lens.surfaces[0].semi_aperture_mm
    for _ in range(LOOKS):
        aims = np.stack((np.zeros(FAN), np.linspace(low_mm, high_mm, FAN), np.zeros(FAN)), axis=-1)
        rays = through_lens(Rays(np.broadcast_to(point, aims.shape), unit(aims - point)), lens)
        slope = np.abs(rays.direction[:, 1] / rays.direction[:, 2])
        passed = np.flatnonzero(np.isfinite(slope))
        if not passed.size:
            break
        steepest = max(steepest, float(slope[passed].max()))
        # The rim lies between the last ray that passes and the next one.
        low_mm, high_mm = aims[passed[-1], 1], aims[min(passed[-1] + 1, FAN - 1), 1]
    return 1 / (2 * steepest) if steepest > 0 else None


def spot(rays: Rays, bench: Bench, *, image_mm: float) -> Focus:
    """Return the spot of a bundle of rays on a plane behind the last vertex.

    Parameters
    ----------
    rays
        The rays behind the imaging lens: positions and directions, each float64 (ray, 3), mm and unit vectors.
    bench
        The bench of the rig.
    image_mm
        The place of the image plane behind the last vertex, mm.
    """
    points = rays.at_z(bench.lens_end_mm + image_mm)[:, :2]
    middle = points.mean(axis=0)
    rms_mm = float(np.sqrt(np.sum((points - middle) ** 2, axis=1).mean()))
    return Focus(image_mm=image_mm, rms_mm=rms_mm, height_mm=float(middle[1]))


def used_rays(bench: Bench, *, object_mm: float, height_mm: float) -> Rays | None:
    """Return the rays of a point behind the imaging lens that the array captures, evenly spaced, shape (ray, 3).

    Parameters
    ----------
    bench
        The bench of the rig.
    object_mm
        The distance of the point's plane before surface 1, mm.
    height_mm
        The height of the point above the axis, along y, mm.

    Raises
    ------
    ValueError
        If the rig has no imaging lens.
    """
    lens = bench.imaging_lens
    if lens is None:
        raise ValueError("expected an imaging lens, got direct pickup")
    reach = lens.surfaces[0].semi_aperture_mm
    low, high = np.full(2, -reach), np.full(2, reach)
    point, used = np.array([0.0, height_mm, -object_mm]), None
    for _ in range(LOOKS):
        aims = _grid(low, high)
        rays = through_lens(Rays(np.broadcast_to(point, aims.shape), unit(aims - point)), lens)
        taken = taken_by_array(bench, rays)
        if not taken.any():
            break
        used = Rays(rays.position[taken], rays.direction[taken])
        step = (high - low) / (AIMED - 1)
        low, high = aims[taken, :2].min(axis=0) - step, aims[taken, :2].max(axis=0) + step
    return used if used is not None and len(used.position) >= ENOUGH else None


def _grid(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y = (np.linspace(low[axis], high[axis], AIMED) for axis in (0, 1))
    across = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return np.concatenate((across, np.zeros((len(across), 1))), axis=1)


def taken_by_array(bench: Bench, rays: Rays) -> NDArray[np.bool_]:
    """Return which rays behind the imaging lens, shape (ray, 3), the array sends to a pixel, shape (ray,).

    Parameters
    ----------
    bench
        The bench of the rig.
    rays
        The rays behind the imaging lens: positions and directions, each float64 (ray, 3), mm and unit vectors.
    """
    array = bench.rig.lens_array
    with np.errstate(invalid="ignore"):
        met = rays.at_z(bench.mla_z_mm)[:, :2]
        slope = rays.direction[:, :2] / rays.direction[:, 2:]
        if bench.rig.camera.projection == "perspective":  # its rays converge at the camera
            slope = slope + met / (bench.camera_z_mm - bench.mla_z_mm)
        inside = np.all(np.abs(met) <= np.array(lattice.extent_mm(array)) / 2, axis=1)
        return np.asarray(inside & lattice.inside_cell(array, slope * array.focal_length_mm))
