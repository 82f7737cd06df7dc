"""The rays that a drawing of the bench shows: exact, in the plane of the drawing, as (z, height) points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.trace import Rays, steps, unit
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.bench import Bench, camera_rays, through_array
from lippmann.optics.rig.spots import taken_by_array

FAN = 7
"""The number of rays of a point."""
TRIED = 601
"""The number of directions in which they are searched."""
VIEW = 5
"""The number of rays of one lens."""

Path = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Drawn:
    """A ray: its path to the array, and the continuation to the image."""

    way: Path
    beyond: Path
    """The path from the array to the image, if the image lies behind the array."""


def fan(bench: Bench, *, object_mm: float, height_mm: float, image_mm: float | None) -> tuple[Drawn, ...]:
    """Return evenly spaced rays from a point to the array; none if no light arrives.

    Parameters
    ----------
    bench
        The bench of the rig.
    height_mm
        The height of the point above the axis, mm.
    object_mm
        The distance of the point's plane before the origin, mm.
    image_mm
        The place of the image along the axis, mm; None if there is no image.
    """
    start = np.array([0.0, height_mm, -object_mm])
    far_end = bench.imaging_lens.surfaces[0].semi_aperture_mm if bench.imaging_lens else 0.0
    middle_mm, reach_mm, plane_mm = (0.0, far_end, 0.0) if far_end else _toward_array(bench, object_mm, height_mm)
    aims = np.zeros((TRIED, 3))
    aims[:, 1], aims[:, 2] = np.linspace(middle_mm - reach_mm, middle_mm + reach_mm, TRIED), plane_mm
    rays = Rays(np.broadcast_to(start, aims.shape), unit(aims - start))
    points, rays = _traced(bench, rays)
    taken = np.flatnonzero(taken_by_array(bench, rays))
    chosen = taken[np.linspace(0, len(taken) - 1, min(FAN, len(taken))).round().astype(int)] if len(taken) else taken
    at_array = rays.at_z(bench.mla_z_mm)
    last_z = bench.mla_z_mm if image_mm is None else image_mm
    beyond = rays.at_z(last_z) if last_z > bench.mla_z_mm else at_array
    return tuple(
        Drawn(_path([*(step[ray] for step in points), at_array[ray]]), _path([at_array[ray], beyond[ray]]))
        for ray in chosen
    )


def _toward_array(bench: Bench, object_mm: float, height_mm: float) -> tuple[float, float, float]:
    """Return the middle, the half width and the z of the target in direct pickup: the cone that the array accepts."""
    array = bench.rig.lens_array
    reach_mm = abs(bench.mla_z_mm + object_mm) * array.pitch_mm / (2 * array.focal_length_mm)
    return height_mm, reach_mm, bench.mla_z_mm


def _traced(bench: Bench, rays: Rays, *, backward: bool = False) -> tuple[list[NDArray[np.float64]], Rays]:
    """Return the points where rays start and meet every surface, and their directions behind the last one."""
    points = [rays.position]
    if bench.imaging_lens is not None:
        for _, behind in steps(rays, bench.imaging_lens, backward=backward):
            points.append(behind.position)
            rays = behind
    return points, rays


def view_of_lens(bench: Bench, *, object_mm: float) -> tuple[Path, ...]:
    """Return the rays of one lens from the camera to a plane of the scene; none if the lens is dark.

    The lens stands about half-way between the axis and the array's upper edge.

    Parameters
    ----------
    bench
        The bench of the rig.
    object_mm
        The distance of the object plane before the origin, surface 1 of the imaging lens, mm.
    """
    array = bench.rig.lens_array
    centre = lattice.lens_centres_mm(array)[(array.count[0] - 1) // 4, array.count[1] // 2]
    points_mm = np.tile(centre, (VIEW, 1))
    points_mm[:, 1] += np.linspace(-0.48, 0.48, VIEW) * array.pitch_mm
    camera = camera_rays(bench, points_mm)
    behind_array = through_array(camera, bench)
    points, rays = _traced(bench, behind_array, backward=True)
    seen = rays.at_z(-object_mm)
    whole = [camera.position, *points, seen]
    return tuple(_path([step[ray] for step in whole]) for ray in range(VIEW) if np.isfinite(rays.direction[ray]).all())


def _path(points: list[NDArray[np.float64]]) -> Path:
    return tuple((float(point[2]), float(point[1])) for point in points)
