"""The exact trace of skew rays through spheres, planes, aspheres and stops, vectorised.

The trace is written once, by components and on any library of arrays (`Ray`, `lippmann.lattice.arrays`): the second
half of this module. The first half is the same for NumPy's arrays of vectors: positions and directions of shape
(..., 3) in the rig frame, mm; directions are unit vectors. A ray that misses a surface, passes outside its aperture or
is totally reflected becomes NaN and stays so.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.arrays import NUMPY, Arrays
from lippmann.optics.lens.asphere import meet_profile
from lippmann.optics.lens.ray import Ray, Vector, dot
from lippmann.optics.lens.surfaces import ImagingLens, Stop, Surface

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rays:
    """A bundle of rays: one point and the direction of each ray."""

    position: Array
    """The points, float64 (..., 3), mm."""
    direction: Array
    """The directions, float64 (..., 3), unit vectors."""

    @classmethod
    def of(cls, ray: Ray) -> Rays:
        """Return rays that are given by their components, which are arrays of NumPy."""
        position, direction = np.broadcast_arrays(stacked(ray.position), stacked(ray.direction))
        return cls(position, direction)

    @property
    def parts(self) -> Ray:
        """The same rays by their components."""
        return Ray(components(self.position), components(self.direction))

    def at_z(self, z_mm: float | Array) -> Array:
        """Return the intersections of the rays with the plane of a z, shape (..., 3)."""
        step = (z_mm - self.position[..., 2]) / self.direction[..., 2]
        points: Array = self.position + step[..., np.newaxis] * self.direction
        return points


def components(vectors: Array) -> Vector:
    """Return the components of vectors (..., 3)."""
    return vectors[..., 0], vectors[..., 1], vectors[..., 2]


def stacked(vector: Vector) -> Array:
    """Return vectors (..., 3) of their components, which broadcast with each other."""
    shape = np.broadcast_shapes(*(np.shape(part) for part in vector))
    vectors = np.empty((*shape, 3))
    for axis, part in enumerate(vector):
        vectors[..., axis] = part
    return vectors


def unit(vectors: Array) -> Array:
    """Return vectors (..., 3) scaled to length 1."""
    scaled: Array = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return scaled


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
    return Rays.of(ray_through_lens(rays.parts, lens, backward=backward, stopped=stopped))


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
    for place, ray in ray_steps(rays.parts, lens, backward=backward, stopped=stopped):
        yield place, Rays.of(ray)


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


def ray_through_lens(
    ray: Ray, lens: ImagingLens, *, backward: bool = False, stopped: bool = True, xp: Arrays = NUMPY
) -> Ray:
    """Trace rays by their components; see `through_lens`.

    Parameters
    ----------
    ray
        The rays, by their components.
    lens
        The imaging lens.
    backward
        True from the side of the camera to that of the scene.
    stopped
        True if rays outside the aperture of a surface or the stop end there.
    xp
        The library of the arrays.
    """
    for _, after in ray_steps(ray, lens, backward=backward, stopped=stopped, xp=xp):
        ray = after
    return ray


def ray_steps(
    ray: Ray, lens: ImagingLens, *, backward: bool = False, stopped: bool = True, xp: Arrays = NUMPY
) -> Iterator[tuple[int | Stop, Ray]]:
    """Trace rays by their components; see `steps`.

    Parameters
    ----------
    ray
        The rays, by their components.
    lens
        The imaging lens.
    backward
        True from the side of the camera to that of the scene.
    stopped
        True if rays outside the aperture of a surface or the stop end there.
    xp
        The library of the arrays.
    """
    table = list(zip(lens.surfaces, lens.vertices_mm, lens.indices_before, strict=True))
    places: list[int | Stop] = list(range(len(table)))
    if lens.stop is not None:
        places.insert(lens.surfaces_before_stop, lens.stop)
    for place in reversed(places) if backward else places:
        if isinstance(place, Stop):
            if stopped:
                inside = _inside(ray.at_z(place.z_mm), place.semi_aperture_mm)
                ray = Ray(ray.position, _ended_outside(ray.direction, inside, xp))
        else:
            ray = _through_surface(ray, *table[place], backward=backward, stopped=stopped, xp=xp)
        yield place, ray


def _through_surface(
    ray: Ray, surface: Surface, z_mm: float, index_before: float, *, backward: bool, stopped: bool, xp: Arrays
) -> Ray:
    points, normals = _meet(ray, surface, z_mm, xp)
    media = (surface.index_after, index_before) if backward else (index_before, surface.index_after)
    direction = refract(ray.direction, normals, index_before=media[0], index_after=media[1], xp=xp)
    if stopped and not math.isinf(surface.semi_aperture_mm):
        direction = _ended_outside(direction, _inside(points, surface.semi_aperture_mm), xp)
    return Ray(points, direction)


def _meet(ray: Ray, surface: Surface, z_mm: float, xp: Arrays) -> tuple[Vector, Vector]:
    if not surface.is_spherical:
        return meet_profile(ray, surface.profile, vertex_z_mm=z_mm, xp=xp)
    if math.isinf(surface.radius_mm):
        return meet_plane(ray, z_mm)
    return meet_sphere(ray, vertex_z_mm=z_mm, radius_mm=surface.radius_mm, xp=xp)


def meet_plane(ray: Ray, z_mm: float) -> tuple[Vector, Vector]:
    """Return the intersections of rays with the plane of a z, mm, and the normals (0, 0, 1) there.

    Parameters
    ----------
    ray
        The rays, by their components.
    z_mm
        The place of the plane along the axis, mm.
    """
    return ray.at_z(z_mm), (0.0, 0.0, 1.0)


def meet_sphere(
    ray: Ray, *, vertex_z_mm: float, radius_mm: float, centre_xy_mm: tuple[Any, Any] = (0.0, 0.0), xp: Arrays = NUMPY
) -> tuple[Vector, Vector]:
    """Return the intersections of rays with a sphere near its vertex, and the normals there.

    Parameters
    ----------
    ray
        The rays.
    vertex_z_mm
        The z of the vertex; the centre lies at vertex + radius.
    radius_mm
        The signed radius, positive if the centre lies at greater z, mm.
    centre_xy_mm
        The centres across the axis, mm.
    xp
        The library of the arrays.
    """
    x, y, z = ray.position
    to_centre = (centre_xy_mm[0] - x, centre_xy_mm[1] - y, vertex_z_mm + radius_mm - z)
    along = dot(to_centre, ray.direction)
    square = along * along - dot(to_centre, to_centre) + radius_mm**2
    root = xp.sqrt(xp.where(square >= 0, square, math.nan))
    # Select the intersection on the side of the vertex: the first if the ray meets the vertex before the centre.
    is_first = (ray.direction[2] > 0) if radius_mm > 0 else (ray.direction[2] < 0)
    distance = xp.where(is_first, along - root, along + root)
    points = ray.at(distance)
    normals = [(to_centre[axis] - distance * ray.direction[axis]) / radius_mm for axis in range(3)]
    return points, (normals[0], normals[1], normals[2])


def refract(
    direction: Vector, normal: Vector, *, index_before: float, index_after: float, xp: Arrays = NUMPY
) -> Vector:
    """Return directions behind a surface by Snell's law in vector form (Glassner 1989, section 2.4).

    Normals may point to either side. Totally reflected rays become NaN.

    Parameters
    ----------
    direction
        The unit vectors of the rays.
    normal
        The unit normals of the surface, to either side.
    index_before
        The index of refraction before the surface.
    index_after
        The index of refraction behind the surface.
    xp
        The library of the arrays.
    """
    ratio = index_before / index_after
    cosine = dot(direction, normal)
    square = 1.0 - ratio**2 * (1.0 - cosine * cosine)
    after = xp.sqrt(xp.where(square >= 0, square, math.nan))
    # The part along the normal that faces the ray, by the side on which the normal stands.
    along = xp.where(cosine < 0, -after, after) - ratio * cosine
    x, y, z = (ratio * part + along * facing for part, facing in zip(direction, normal, strict=True))
    return x, y, z


def _inside(points: Vector, semi_aperture_mm: float) -> Any:
    return points[0] * points[0] + points[1] * points[1] <= semi_aperture_mm**2


def _ended_outside(direction: Vector, inside: Any, xp: Arrays) -> Vector:
    x, y, z = (xp.where(inside, part, math.nan) for part in direction)
    return x, y, z
