"""The exact trace of skew rays through spheres, planes, aspheres and stops, vectorised.

Positions and directions are arrays of shape (..., 3) in the rig frame, mm; directions are unit vectors. A ray that
misses a surface, passes outside its aperture or is totally reflected becomes NaN and stays so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.asphere import meet_profile
from lippmann.optics.lens.surfaces import ImagingLens, Stop, Surface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rays:
    """A bundle of rays: one point and the direction of each ray."""

    position: Array
    """The points, float64 (..., 3), mm."""
    direction: Array
    """The directions, float64 (..., 3), unit vectors."""

    def at_z(self, z_mm: float | Array) -> Array:
        """Return the intersections of the rays with the plane of a z, shape (..., 3)."""
        step = (z_mm - self.position[..., 2]) / self.direction[..., 2]
        points: Array = self.position + step[..., np.newaxis] * self.direction
        return points


def unit(vectors: Array) -> Array:
    """Return vectors (..., 3) scaled to length 1."""
    scaled: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return scaled


def meet_plane(rays: Rays, z_mm: float) -> tuple[Array, Array]:
    """Return the intersections of rays with the plane of a z and the normals (0, 0, 1) there, each (..., 3).

    Parameters
    ----------
    rays
        The rays: positions and directions, each float64 (..., 3), mm and unit vectors.
    z_mm
        The place of the plane along the axis, mm.
    """
    points = rays.at_z(z_mm)
    return points, np.broadcast_to(np.array([0.0, 0.0, 1.0]), points.shape)


def meet_sphere(rays: Rays, *, vertex_z_mm: float, radius_mm: float, centre_xy_mm: Array) -> tuple[Array, Array]:
    """Return the intersections of rays with a sphere near its vertex, and the normals there, each (..., 3).

    Parameters
    ----------
    rays
        The rays: positions and directions, each float64 (..., 3), mm and unit vectors.
    vertex_z_mm
        The z of the vertex; the centre lies at vertex + radius.
    radius_mm
        The signed radius, positive if the centre lies at greater z, mm.
    centre_xy_mm
        The centres across the axis, float64 (..., 2), mm.
    """
    centre = np.empty((*np.broadcast_shapes(rays.position.shape[:-1], centre_xy_mm.shape[:-1]), 3))
    centre[..., :2] = centre_xy_mm
    centre[..., 2] = vertex_z_mm + radius_mm
    to_centre = centre - rays.position
    along = np.sum(to_centre * rays.direction, axis=-1)
    square = along**2 - np.sum(to_centre**2, axis=-1) + radius_mm**2
    root = np.sqrt(np.where(square >= 0, square, np.nan))
    # Select the intersection on the side of the vertex: the first if the ray meets the vertex before the centre.
    toward = np.sign(radius_mm) * np.sign(rays.direction[..., 2])
    points = rays.position + (along - toward * root)[..., np.newaxis] * rays.direction
    return points, (centre - points) / radius_mm


def refract(direction: Array, normal: Array, *, index_before: float, index_after: float) -> Array:
    """Return directions behind a surface by Snell's law in vector form (Glassner 1989, section 2.4), shape (..., 3).

    Normals may point to either side. Totally reflected rays become NaN.

    Parameters
    ----------
    direction
        The unit vectors of the rays, float64 (..., 3).
    normal
        The unit normals of the surface, float64 (..., 3), to either side.
    index_before
        The index of refraction before the surface.
    index_after
        The index of refraction behind the surface.
    """
    ratio = index_before / index_after
    cosine = np.sum(direction * normal, axis=-1, keepdims=True)
    facing = np.where(cosine < 0, -normal, normal)
    cosine = np.abs(cosine)
    square = 1.0 - ratio**2 * (1.0 - cosine**2)
    after = np.sqrt(np.where(square >= 0, square, np.nan))
    refracted: Array = ratio * direction + (after - ratio * cosine) * facing
    return refracted


def through_lens(rays: Rays, lens: ImagingLens, *, backward: bool = False, stopped: bool = True) -> Rays:
    """Trace rays through an imaging lens whose first vertex is the origin.

    Parameters
    ----------
    rays
        The rays: positions and directions, each float64 (..., 3), mm and unit vectors.
    lens
        The imaging lens.
    backward
        True to trace from the side of the camera to that of the scene, through the surfaces in reverse order.
    stopped
        True if rays outside the aperture of a surface or the stop end there.
    """
    for _, after in steps(rays, lens, backward=backward, stopped=stopped):
        rays = after
    return rays


def steps(
    rays: Rays, lens: ImagingLens, *, backward: bool = False, stopped: bool = True
) -> Iterator[tuple[int | Stop, Rays]]:
    """Trace rays as `through_lens` does, and yield them behind every surface, by its number, and the stop.

    Parameters
    ----------
    rays
        The rays: positions and directions, each float64 (..., 3), mm and unit vectors.
    lens
        The imaging lens.
    backward
        True from the side of the camera to that of the scene.
    stopped
        True if rays outside a surface's aperture, or the stop's hole, end there.
    """
    table = list(zip(lens.surfaces, lens.vertices_mm, lens.indices_before, strict=True))
    places: list[int | Stop] = list(range(len(table)))
    if lens.stop is not None:
        places.insert(lens.surfaces_before_stop, lens.stop)
    for place in reversed(places) if backward else places:
        if isinstance(place, Stop):
            rays = _through_stop(rays, place, stopped=stopped)
        else:
            rays = _through_surface(rays, *table[place], backward=backward, stopped=stopped)
        yield place, rays


def _through_stop(rays: Rays, stop: Stop, *, stopped: bool) -> Rays:
    points = rays.at_z(stop.z_mm)
    return Rays(rays.position, _ended_outside(rays.direction, points, stop.semi_aperture_mm if stopped else math.inf))


def _through_surface(
    rays: Rays, surface: Surface, z_mm: float, index_before: float, *, backward: bool, stopped: bool
) -> Rays:
    points, normals = _meet(rays, surface, z_mm)
    media = (surface.index_after, index_before) if backward else (index_before, surface.index_after)
    direction = refract(rays.direction, normals, index_before=media[0], index_after=media[1])
    return Rays(points, _ended_outside(direction, points, surface.semi_aperture_mm if stopped else math.inf))


def _meet(rays: Rays, surface: Surface, z_mm: float) -> tuple[Array, Array]:
    if not surface.is_spherical:
        return meet_profile(rays.position, rays.direction, surface.profile, vertex_z_mm=z_mm)
    if math.isinf(surface.radius_mm):
        return meet_plane(rays, z_mm)
    return meet_sphere(rays, vertex_z_mm=z_mm, radius_mm=surface.radius_mm, centre_xy_mm=np.zeros(2))


def _ended_outside(direction: Array, points: Array, semi_aperture_mm: float) -> Array:
    outside = np.hypot(points[..., 0], points[..., 1]) > semi_aperture_mm
    return np.where(outside[..., np.newaxis], np.nan, direction)


def axis_crossing_mm(lens: ImagingLens, *, object_mm: float, height_mm: float) -> float:
    """Return the distance behind the last vertex at which a ray from the axis crosses the axis again.

    The ray leaves the axis `object_mm` before the first vertex and meets the plane of that vertex `height_mm` high;
    apertures do not stop it.

    Parameters
    ----------
    lens
        The imaging lens.
    object_mm
        The distance of the point on the axis before the first vertex, mm.
    height_mm
        The height at which the ray meets the plane of the first vertex, mm.

    Examples
    --------
    >>> from lippmann.optics.lens.published import ATHINEOS_2006
    >>> round(axis_crossing_mm(ATHINEOS_2006, object_mm=1000.0, height_mm=40.0), 6)
    177.995223
    """
    start = np.array([0.0, 0.0, -object_mm])
    rays = through_lens(Rays(start, unit(np.array([0.0, height_mm, object_mm]))), lens, stopped=False)
    step = -rays.position[1] / rays.direction[1]
    return float(rays.position[2] + step * rays.direction[2] - lens.length_mm)
