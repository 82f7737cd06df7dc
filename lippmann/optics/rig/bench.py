"""The bench: the positions of imaging lens, MLA and camera, and the ray of every pixel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import FieldProblem, OpticsError
from lippmann.job.optics.rig import Rig
from lippmann.lattice.arrays import NUMPY, Arrays
from lippmann.optics.lens.matrices import conjugate
from lippmann.optics.lens.prescription import ImagingLens, rig_lens
from lippmann.optics.lens.ray import Ray, Vector
from lippmann.optics.lens.trace import Rays, meet_plane, meet_sphere, ray_through_lens, refract
from lippmann.optics.rig import array as lattice
from lippmann.optics.rig.microlens import Microlens, microlens

ORTHOGRAPHIC_DISTANCE_MM = 20.0
"""The distance from the MLA to an orthographic camera. Any position behind the lenses gives the same picture; behind
thick lenses the camera stands twice as far."""

CLEAR_OF_LENSES = 1.01
"""The least distance of a perspective camera from the MLA, in thicknesses of the lenses."""

WHOLE = (slice(None), slice(None))
"""The region of a whole picture."""


@dataclass(frozen=True)
class Bench:
    """The elements of a rig in the rig frame, mm."""

    imaging_lens: ImagingLens | None
    """The imaging lens, with surfaces in contact moved apart; None for direct pickup, where the origin takes the
    position of surface 1."""
    microlens: Microlens
    mla_z_mm: float
    """The z of the flat side of the lenses, the MLA plane."""
    camera_z_mm: float
    width_mm: float
    """The camera's window on the MLA plane."""
    height_mm: float
    rig: Rig

    @property
    def lens_end_mm(self) -> float:
        """The last vertex of the imaging lens; 0 without one."""
        return self.imaging_lens.length_mm if self.imaging_lens else 0.0

    @property
    def mla_behind_lens_mm(self) -> float:
        """The distance from the last vertex of the imaging lens to the MLA."""
        return self.mla_z_mm - self.lens_end_mm

    def image_z_mm(self, object_mm: float) -> float:
        """Return the z of the paraxial image of the plane `object_mm` before the origin; its own z without lens."""
        if self.imaging_lens is None:
            return -object_mm
        return self.lens_end_mm + conjugate(self.imaging_lens, object_mm).image_mm

    def s_mm(self, object_mm: float) -> float:
        """Return the depth at which the plane `object_mm` before the origin is shown (paraxial)."""
        return self.image_z_mm(object_mm) - self.mla_z_mm


def bench(rig: Rig, *, reference_mm: float) -> Bench:
    """Compute the bench of a rig for a scene whose reference plane lies `reference_mm` before surface 1.

    The MLA is `offset_mm` from the paraxial image of the reference plane, toward the imaging lens. Without imaging
    lens that plane is its own image.

    Parameters
    ----------
    rig
        The rig of the job.
    reference_mm
        The distance of the scene's reference plane before surface 1, mm.

    Raises
    ------
    OpticsError, SpecError
        If a lens cannot be built, or the imaging lens is unknown.
    """
    lens = rig_lens(rig)
    image_z_mm = lens.length_mm + conjugate(lens, reference_mm).image_mm if lens else -reference_mm
    width_mm, height_mm = lattice.window_mm(rig)
    shape = microlens(rig.lens_array)
    _check_camera(rig, shape)
    mla_z_mm = image_z_mm - rig.lens_array.offset_mm
    return Bench(
        imaging_lens=lens,
        microlens=shape,
        mla_z_mm=mla_z_mm,
        camera_z_mm=mla_z_mm + camera_distance_mm(rig),
        width_mm=width_mm,
        height_mm=height_mm,
        rig=rig,
    )


def _check_camera(rig: Rig, shape: Microlens) -> None:
    least_mm = CLEAR_OF_LENSES * shape.thickness_mm
    if rig.camera.projection == "perspective" and perspective_distance_mm(rig) < least_mm:
        most_deg = 2 * math.degrees(math.atan(lattice.view_width_mm(rig) / (2 * least_mm)))
        expected = f"at most {most_deg:.4g} degrees, so that the camera stands behind the lenses of the array"
        got = f"{rig.camera.angle_deg:g} degrees, {perspective_distance_mm(rig):.4g} mm from their flat side"
        raise OpticsError.of([FieldProblem(field="rig.camera.angle_deg", expected=expected, got=got)])


def camera_distance_mm(rig: Rig) -> float:
    """Return the distance of the camera from the MLA plane.

    The angle of a perspective camera just spans the window: L = width / (2 tan(angle / 2)), so that pixels
    fall evenly under the lenses (Athineos 2006, section 4.1).

    >>> from lippmann.job.optics.rig import Camera, Device
    >>> device = Device(dpi=600, window_px=(2400, 2400))
    >>> round(camera_distance_mm(Rig(camera=Camera(projection="perspective"), device=device)), 1)
    862.9
    """
    if rig.camera.projection == "orthographic":
        return max(ORTHOGRAPHIC_DISTANCE_MM, 2 * microlens(rig.lens_array).thickness_mm)
    return perspective_distance_mm(rig)


def perspective_distance_mm(rig: Rig) -> float:
    """Return the distance from the MLA plane of a perspective camera with the angle of the rig."""
    return lattice.view_width_mm(rig) / (2 * math.tan(math.radians(rig.camera.angle_deg) / 2))


def pixel_centres_mm(
    bench: Bench, *, rows: int | None = None, cols: int | None = None, region: tuple[slice, slice] = WHOLE
) -> NDArray[np.float64]:
    """Return the centres of the pixels on the MLA plane, shape (row, col, 2), mm as (x, y); row 0 is the top.

    Parameters
    ----------
    bench
        The bench of the rig.
    rows, cols
        The size of a picture of the whole window; by default that of the integral image.
    region
        The rows and columns that are wanted, as two slices.
    """
    rows, cols = rows or bench.rig.layout.rows, cols or bench.rig.layout.cols
    x = (np.arange(cols)[region[1]] + 0.5) * (bench.width_mm / cols) - bench.width_mm / 2
    y = bench.height_mm / 2 - (np.arange(rows)[region[0]] + 0.5) * (bench.height_mm / rows)
    return np.stack(np.meshgrid(x, y), axis=-1)


def camera_rays(bench: Bench, points_mm: NDArray[np.float64]) -> Rays:
    """Return the camera's rays through points of the MLA plane, shape (..., 2), before any glass.

    Parameters
    ----------
    bench
        The bench of the rig.
    points_mm
        The points of the MLA plane, float64 (..., 2), mm as (x, y).
    """
    return Rays.of(camera_ray(bench, points_mm[..., 0], points_mm[..., 1]))


def through_array(rays: Rays, bench: Bench) -> Rays:
    """Trace camera rays through the lens they meet: convex side first, then the flat side.

    Each ray belongs to the lens in whose cell it meets the array. The lens is first found in the plane of the rims,
    then at the intersection with the sphere. Rays beside the glass (dead corners of an inscribed aperture, gaps between
    hexagons at the edge of the array) pass straight.

    Parameters
    ----------
    rays
        The rays of the camera: positions and directions, each float64 (..., 3), mm and unit vectors.
    bench
        The bench of the rig.
    """
    return Rays.of(ray_through_array(rays.parts, bench))


def through_microlens(rays: Rays, bench: Bench, centres_mm: NDArray[np.float64]) -> tuple[Rays, NDArray[np.float64]]:
    """Trace camera rays through lenses of the array at `centres_mm`, (..., 2), without regard to their rims.

    Parameters
    ----------
    rays
        The rays of the camera: positions and directions, each float64 (..., 3), mm and unit vectors.
    bench
        The bench of the rig.
    centres_mm
        The centres of the lenses, float64 (..., 2), mm as (x, y).

    Returns
    -------
    tuple
        The rays behind the flat side, and the z at which each met the convex one, mm.
    """
    ray, convex_z_mm = ray_through_microlens(rays.parts, bench, (centres_mm[..., 0], centres_mm[..., 1]))
    return Rays.of(ray), convex_z_mm


def object_rays(bench: Bench, points_mm: NDArray[np.float64]) -> Rays:
    """Return the rays in the scene's space that the camera sees through points (..., 2) of the MLA plane.

    This is the exact map that the modelled glass must reproduce. Rays stopped by an aperture are NaN.

    Parameters
    ----------
    bench
        The bench of the rig.
    points_mm
        The points of the MLA plane, float64 (..., 2), mm as (x, y).
    """
    return Rays.of(object_ray(bench, points_mm[..., 0], points_mm[..., 1]))


def object_ray(bench: Bench, x_mm: Any, y_mm: Any, *, xp: Arrays = NUMPY) -> Ray:
    """Return the rays in the scene's space through points of the MLA plane, by components; see `object_rays`.

    Parameters
    ----------
    bench
        The bench of the rig.
    x_mm, y_mm
        The points, arrays of 64-bit numbers of one shape, mm.
    xp
        The library of the arrays.
    """
    ray = ray_through_array(camera_ray(bench, x_mm, y_mm, xp=xp), bench, xp=xp)
    return ray_through_lens(ray, bench.imaging_lens, backward=True, xp=xp) if bench.imaging_lens else ray


def camera_ray(bench: Bench, x_mm: Any, y_mm: Any, *, xp: Arrays = NUMPY) -> Ray:
    """Return the camera's rays through points of the MLA plane, by components; see `camera_rays`.

    Parameters
    ----------
    bench
        The bench of the rig.
    x_mm, y_mm
        The points of the MLA plane, arrays of 64-bit numbers of one shape, mm.
    xp
        The library of the arrays.
    """
    if bench.rig.camera.projection == "orthographic":
        return Ray((x_mm, y_mm, bench.camera_z_mm), (0.0, 0.0, -1.0))
    distance_mm = bench.camera_z_mm - bench.mla_z_mm
    length = xp.sqrt(x_mm * x_mm + y_mm * y_mm + distance_mm**2)
    return Ray((0.0, 0.0, bench.camera_z_mm), (x_mm / length, y_mm / length, -distance_mm / length))


def ray_through_array(ray: Ray, bench: Bench, *, xp: Arrays = NUMPY) -> Ray:
    """Trace camera rays through the lens they meet, by components; see `through_array`.

    Parameters
    ----------
    ray
        The rays of the camera, by their components.
    bench
        The bench of the rig.
    xp
        The library of the arrays.
    """
    array = bench.rig.lens_array
    x, y, _ = ray.at_z(bench.mla_z_mm + bench.microlens.thickness_mm)
    centre = lattice.nearest_centre(array, x, y, xp=xp)
    behind, convex_z_mm = ray_through_microlens(ray, bench, centre, xp=xp)
    in_cell = array.lenses_mm.contains(x - centre[0], y - centre[1], xp=xp)
    in_glass = (convex_z_mm >= bench.mla_z_mm) & in_cell
    straight = Ray(ray.at_z(bench.mla_z_mm), ray.direction)
    return Ray(
        _chosen(in_glass, behind.position, straight.position, xp),
        _chosen(in_glass, behind.direction, straight.direction, xp),
    )


def ray_through_microlens(ray: Ray, bench: Bench, centre_mm: tuple[Any, Any], *, xp: Arrays = NUMPY) -> tuple[Ray, Any]:
    """Trace camera rays through lenses of the array at some centres, by components; see `through_microlens`.

    Parameters
    ----------
    ray
        The rays of the camera, by their components.
    bench
        The bench of the rig.
    centre_mm
        The centres of the lenses, (x, y), mm.
    xp
        The library of the arrays.
    """
    shape, index = bench.microlens, bench.rig.lens_array.index
    vertex_mm = bench.mla_z_mm + shape.thickness_mm
    points, normals = meet_sphere(ray, vertex_z_mm=vertex_mm, radius_mm=-shape.radius_mm, centre_xy_mm=centre_mm, xp=xp)
    inside = refract(ray.direction, normals, index_before=1.0, index_after=index, xp=xp)
    flat, flat_normals = meet_plane(Ray(points, inside), bench.mla_z_mm)
    outside = refract(inside, flat_normals, index_before=index, index_after=1.0, xp=xp)
    return Ray(flat, outside), points[2]


def _chosen(mask: Any, then: Vector, otherwise: Vector, xp: Arrays) -> Vector:
    x, y, z = (xp.where(mask, one, other) for one, other in zip(then, otherwise, strict=True))
    return x, y, z
