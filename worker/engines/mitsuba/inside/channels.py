"""The hits of the rays of pixel centres: distance, position, normal, albedo and object, in the rig frame and mm."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lippmann.optics.lens.ray import Ray
from worker.engines.mitsuba.inside.messages import MAX_OBJECT_NAME, MAX_OBJECT_NAMES, FileKind, UnsupportedError
from worker.engines.mitsuba.inside.rays import Placement
from worker.engines.mitsuba.inside.scenes import splats

Float32 = NDArray[np.float32]


def channel_values(
    scene: mi.Scene,
    rays: Ray,
    sent: tuple[mi.Ray3f, mi.Bool],
    placement: Placement,
    kinds: Collection[FileKind],
    splat_light: splats.SplatLight | None,
) -> dict[FileKind, Float32]:
    """Return the channels of rays, each float32 (ray, number); see `messages.FILE_CHANNELS`.

    Parameters
    ----------
    scene
        The scene.
    rays
        The rays of the centres of pixels, rig frame, NaN where one is dead.
    sent
        The same rays in the scene, and which are alive.
    placement
        The place of the rig in the scene.
    kinds
        The channels that are wanted.
    splat_light
        What the rays receive in a scene of splats, which has no surfaces to hit.
    """
    ray, alive = sent
    found: Any = None if splat_light else scene.ray_intersect(ray, active=alive)
    distance = splat_light.distance if splat_light else found.t
    distance_mm = dr.select(alive, mi.Float64(distance) * placement.mm_per_unit, dr.nan)
    values: dict[FileKind, Float32] = {"distance": _columns(mi.Float(distance_mm))}
    if "position" in kinds:
        values["position"] = _columns([dr.select(dr.isinf(distance_mm), dr.inf, part) for part in rays.at(distance_mm)])
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
    wrong = [kind for kind in kinds if kind in ("normal", "albedo", "object", "motion")]
    if wrong and holds_splats(scene):
        raise UnsupportedError(f"Splats have no channel {', '.join(wrong)}: they have no surfaces.")


def _surface_values(
    scene: mi.Scene, found: Any, ray: mi.Ray3f, placement: Placement, kinds: Collection[FileKind]
) -> dict[FileKind, Float32]:
    """Return the channels of the surfaces that rays hit."""
    values: dict[FileKind, Float32] = {}
    if "normal" in kinds:
        towards = dr.mulsign(found.sh_frame.n, dr.dot(found.sh_frame.n, -ray.d))
        normal = dr.normalize(placement.rig_direction(towards))
        values["normal"] = _columns(dr.select(found.is_valid(), normal, dr.nan))
    if "albedo" in kinds:
        bsdf = found.bsdf()
        # Of a surface that is not diffuse, Mitsuba returns the height of its highlight.
        is_diffuse = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Diffuse)
        reflectance = bsdf.eval_diffuse_reflectance(found, found.is_valid() & is_diffuse)
        albedo = dr.select(is_diffuse & dr.isfinite(reflectance), dr.clip(reflectance, 0, 1), 0)
        values["albedo"] = _columns(dr.select(found.is_valid(), albedo, dr.nan))
    if "object" in kinds:
        values["object"] = object_numbers(scene, found)
    return values


def object_names(scene: mi.Scene, names: Mapping[str, str]) -> tuple[tuple[str, ...], str]:
    """Return the names of the shapes of a scene from number 1, and a note if some are left out.

    Parameters
    ----------
    scene
        The scene.
    names
        The names that a loader gives to identifiers of shapes; the others have their identifier as name.
    """
    found: list[str] = []
    room = MAX_OBJECT_NAMES
    for shape in scene.shapes():
        given = names.get(shape.id(), shape.id())
        name = "".join(letter for letter in given if letter.isprintable())[:MAX_OBJECT_NAME]
        room -= len(json.dumps(name, ensure_ascii=False).encode()) + 2
        found.append(name if room > 0 else "")
    is_long = f"the names of the {len(found):,} objects are longer than {MAX_OBJECT_NAMES:,} bytes: some are left out"
    return tuple(found), "" if room > 0 else is_long


def _columns(parts: Any) -> Float32:
    """Return the components of vectors, or numbers, as float32 (ray, number)."""
    parts = [parts] if isinstance(parts, mi.Float) else list(parts)
    return np.stack([np.array(mi.Float(part)) for part in parts], axis=-1)


def object_numbers(scene: mi.Scene, found: Any) -> Float32:
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
