"""What the rays of pixel centres hit: distance, position, normal, albedo and object, in the rig frame and mm."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.trace import Rays
from worker.engines.mitsuba.inside.messages import FileKind, UnsupportedError
from worker.engines.mitsuba.inside.rays import Placement
from worker.engines.mitsuba.inside.scenes import splats

Float32 = NDArray[np.float32]


def channel_values(
    scene: mi.Scene, rays: Rays, ray: mi.Ray3f, placement: Placement, kinds: Collection[FileKind]
) -> dict[FileKind, Float32]:
    """Return the channels of rays, each float32 (ray, number); see `messages.FILE_CHANNELS`.

    Parameters
    ----------
    scene
        The scene.
    rays
        The rays of the centres of pixels, rig frame, NaN where one is dead.
    ray
        The same rays in scene units.
    placement
        The place of the rig in the scene.
    kinds
        The channels that are wanted.
    """
    dead = np.isnan(rays.direction).any(axis=-1)
    if holds_splats(scene):
        distance = splats.radiance(scene, ray, mi.Bool(~dead)).distance
        found = None
    else:
        found = scene.ray_intersect(ray, active=mi.Bool(~dead))
        distance = found.t
    values: dict[FileKind, Float32] = {}
    if "distance" in kinds or "position" in kinds:
        distance_mm = np.array(distance, dtype=np.float64) * placement.mm_per_unit
        distance_mm[dead] = np.nan
        values["distance"] = distance_mm.astype(np.float32)[:, np.newaxis]
        position_mm = np.where(
            np.isinf(distance_mm)[:, np.newaxis], np.inf, rays.position + distance_mm[:, np.newaxis] * rays.direction
        )
        values["position"] = position_mm.astype(np.float32)
    if found is not None:
        values |= _surface_values(scene, found, ray, placement, kinds)
    return {kind: values[kind] for kind in kinds}


def holds_splats(scene: mi.Scene) -> bool:
    """Return True for a scene of Gaussian splats, which have no surfaces."""
    shapes = scene.shapes()
    return len(shapes) == 1 and int(shapes[0].shape_type()) == int(mi.ShapeType.EllipsoidsMesh)


def check_channels(scene: mi.Scene, kinds: Collection[FileKind]) -> None:
    """Refuse channels that a scene does not have.

    Raises
    ------
    UnsupportedError
        If splats are asked for what only surfaces have.
    """
    wrong = [kind for kind in kinds if kind in ("normal", "albedo", "object")]
    if wrong and holds_splats(scene):
        raise UnsupportedError(f"Splats have no channel {', '.join(wrong)}: they have no surfaces.")


def _surface_values(
    scene: mi.Scene, found: Any, ray: mi.Ray3f, placement: Placement, kinds: Collection[FileKind]
) -> dict[FileKind, Float32]:
    """Return the channels of the surfaces that rays hit."""
    values: dict[FileKind, Float32] = {}
    if "normal" in kinds:
        towards = dr.select(found.is_valid(), dr.mulsign(found.sh_frame.n, dr.dot(found.sh_frame.n, -ray.d)), 0)
        values["normal"] = placement.rig_directions(_columns(towards)).astype(np.float32)
    if "albedo" in kinds:
        reflectance = found.bsdf().eval_diffuse_reflectance(found, found.is_valid())
        values["albedo"] = _columns(dr.select(found.is_valid(), reflectance, 0))
    if "object" in kinds:
        values["object"] = _objects(scene, found)
    return values


def _columns(vectors: Any) -> Float32:
    return np.ascontiguousarray(np.array(vectors, dtype=np.float32).T)


def _objects(scene: mi.Scene, found: Any) -> Float32:
    """Return the number of the shape that each ray hits from 1, in the order of the scene, or 0, (ray, 1)."""
    pointers = dr.select(found.instance != None, found.instance, found.shape)  # noqa: E711 - elementwise
    hits = np.array(dr.reinterpret_array(mi.UInt32, pointers))
    shapes = scene.shapes_dr()
    known = np.array(dr.reinterpret_array(mi.UInt32, shapes))
    numbers = np.zeros(int(max(known.max(initial=0), hits.max(initial=0))) + 1, dtype=np.float32)
    numbers[known] = np.arange(1, len(known) + 1)
    numbers[0] = 0
    objects: Float32 = numbers[hits][:, np.newaxis]
    return objects
