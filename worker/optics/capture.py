"""The bench put together: where imaging lens, MLA and camera stand, and the ray that every pixel sees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.job.spec import Rig
from worker.optics import lattice
from worker.optics.matrices import conjugate
from worker.optics.microlens import Microlens, microlens
from worker.optics.prescription import ImagingLens, imaging_lens
from worker.optics.trace import Rays, meet_plane, meet_sphere, refract, through_lens, unit

ORTHOGRAPHIC_DISTANCE_MM = 20.0
"""From the MLA to an orthographic camera: anywhere behind the lenses will do."""


@dataclass(frozen=True)
class Bench:
    """Everything that stands in the rig frame, mm."""

    imaging_lens: ImagingLens
    """As modelled: contact surfaces kept apart."""
    microlens: Microlens
    mla_z_mm: float
    """The flat side of the lenses."""
    camera_z_mm: float
    width_mm: float
    """The camera's window on the MLA plane."""
    height_mm: float
    rig: Rig

    @property
    def mla_behind_lens_mm(self) -> float:
        """From the last vertex of the imaging lens to the MLA."""
        return self.mla_z_mm - self.imaging_lens.length_mm


def bench(rig: Rig, *, reference_mm: float) -> Bench:
    """Put a rig together for a scene whose reference plane lies `reference_mm` before surface 1.

    The MLA stands `offset_mm` from the paraxial image of the reference plane, toward the imaging lens.

    Raises
    ------
    OpticsError, SpecError
        If a lens cannot be, or the imaging lens is unknown.
    """
    lens = imaging_lens(rig.imaging_lens).built()
    image_mm = conjugate(lens, reference_mm).image_mm
    width_mm, height_mm = lattice.extent_mm(rig.lens_array)
    mla_z_mm = lens.length_mm + image_mm - rig.lens_array.offset_mm
    return Bench(
        imaging_lens=lens,
        microlens=microlens(rig.lens_array),
        mla_z_mm=mla_z_mm,
        camera_z_mm=mla_z_mm + camera_distance_mm(rig, width_mm),
        width_mm=width_mm,
        height_mm=height_mm,
        rig=rig,
    )


def camera_distance_mm(rig: Rig, width_mm: float) -> float:
    """Return the distance of the camera from the MLA plane.

    A perspective camera stands where its angle just spans the array: L = width / (2 tan(angle / 2)), so that pixels
    fall evenly under the lenses (Athineos 2006, section 4.1).

    >>> from worker.job.spec import Camera
    >>> round(camera_distance_mm(Rig(camera=Camera(projection="perspective")), 101.6), 1)
    862.9
    """
    if rig.camera.projection == "orthographic":
        return ORTHOGRAPHIC_DISTANCE_MM
    return width_mm / (2 * math.tan(math.radians(rig.camera.angle_deg) / 2))


def pixel_centres_mm(bench: Bench) -> NDArray[np.float64]:
    """Return where the pixels lie on the MLA plane, shape (row, col, 2), mm as (x, y); row 0 is the top."""
    lens_rows, lens_cols = bench.rig.lens_array.count
    n = bench.rig.px_per_lens
    step = bench.rig.lens_array.pitch_mm / n
    x = (np.arange(lens_cols * n) + 0.5) * step - bench.width_mm / 2
    y = bench.height_mm / 2 - (np.arange(lens_rows * n) + 0.5) * step
    return np.stack(np.meshgrid(x, y), axis=-1)


def camera_rays(bench: Bench, points_mm: NDArray[np.float64]) -> Rays:
    """Return the camera's rays through points of the MLA plane, shape (..., 2), before any glass."""
    points = np.empty((*points_mm.shape[:-1], 3))
    points[..., :2] = points_mm
    points[..., 2] = bench.mla_z_mm
    if bench.rig.camera.projection == "orthographic":
        start = points.copy()
        start[..., 2] = bench.camera_z_mm
    else:
        start = np.broadcast_to(np.array([0.0, 0.0, bench.camera_z_mm]), points.shape)
    return Rays(start, unit(points - start))


def through_array(rays: Rays, bench: Bench) -> Rays:
    """Trace camera rays through the lens they meet: convex side first, then the flat side.

    Each ray is given to the lens in whose cell it meets the array, found at the height of the rim's plane and then
    where it really meets the sphere. Rays beside the glass (dead corners of an inscribed aperture) pass straight.
    """
    shape = bench.microlens
    centres = nearest_centre_mm(bench, rays.at_z(bench.mla_z_mm + shape.thickness_mm)[..., :2])
    vertex = bench.mla_z_mm + shape.thickness_mm
    points, normals = meet_sphere(rays, vertex_z_mm=vertex, radius_mm=-shape.radius_mm, centre_xy_mm=centres)
    inside = refract(rays.direction, normals, index_before=1.0, index_after=bench.rig.lens_array.index)
    flat, flat_normals = meet_plane(Rays(points, inside), bench.mla_z_mm)
    outside = refract(inside, flat_normals, index_before=bench.rig.lens_array.index, index_after=1.0)
    beside = ~(points[..., 2] >= bench.mla_z_mm)[..., np.newaxis]
    return Rays(
        np.where(beside, rays.at_z(bench.mla_z_mm), flat),
        np.where(beside, rays.direction, outside),
    )


def nearest_centre_mm(bench: Bench, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the centre of the lens in whose cell each point (..., 2) lies, shape (..., 2)."""
    array = bench.rig.lens_array
    lens_rows, lens_cols = array.count
    half = np.array([bench.width_mm, bench.height_mm]) / 2
    last = np.array([lens_cols - 1, lens_rows - 1])
    cell = np.clip(np.floor((points_mm + half) / array.pitch_mm), 0, last)
    return (cell + 0.5) * array.pitch_mm - half


def object_rays(bench: Bench, points_mm: NDArray[np.float64]) -> Rays:
    """Return the rays in the scene's space that the camera sees through points (..., 2) of the MLA plane.

    This is the exact map that the modelled glass must reproduce. Rays stopped by an aperture are NaN.
    """
    return through_lens(through_array(camera_rays(bench, points_mm), bench), bench.imaging_lens, backward=True)
