"""Ray tracing without noise, as Whitted's: every lamp lights every surface, mirrors and glass are followed both ways.

A lamp lights by one shadow ray, to its middle if it has an extent; what is clear lets it pass (see `shadows`). A sky
lights by a fixed set of directions. A ray splits at a surface into its mirror image, the refracted ray and what passes
through a thin surface. The branches wait on a stack of each ray, so that their order, and with it every bit of the sum,
is fixed.

The method is that of Whitted, An improved illumination model for shaded display, CACM 23(6), 1980.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from worker.engines.mitsuba.inside.shadows import passing, present_flags

MIDDLE = ((0.5, 0.5),)
"""The place on a lamp, in its own coordinates."""
SKY_PLACES = tuple(((k % 4 + 0.5) / 4, (k // 4 + 0.5) / 4) for k in range(16))
"""The places in the sky; shadows have steps and no noise."""

LEAST_WEIGHT = 1e-3
"""The part of a pixel's light below which a branch is not followed: a quarter of a step of 8 bits."""


def whitted_radiance(scene: mi.Scene, ray: mi.Ray3f, depth: int, active: mi.Bool) -> Any:
    """Return the radiance along rays, linear RGB.

    Parameters
    ----------
    scene
        The scene.
    ray
        The rays, scene units.
    depth
        The greatest number of bounces.
    active
        The rays that are traced.
    """
    present = present_flags(scene)
    clear = int(mi.BSDFFlags.DeltaTransmission) | int(mi.BSDFFlags.Null)
    branches, lets_pass = _branches(present), present is None or present & clear != 0
    return _trace(scene, _lamp_table(scene), branches, mi.Ray3f(ray), depth, mi.Bool(active), lets_pass)


def _lamp_table(scene: mi.Scene) -> Any:
    """Return the number of the lamp, the place on it and its part of the light for every shadow ray, as four arrays."""
    rows: list[tuple[int, float, float, float]] = []
    for number, emitter in enumerate(scene.emitters()):
        sky = mi.has_flag(emitter.flags(), mi.EmitterFlags.Infinite)
        delta = mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta)
        places = SKY_PLACES if sky and not delta else MIDDLE
        rows += [(number, *place, 1 / len(places)) for place in places]
    if not rows:
        return None
    numbers, across, down, part = zip(*rows, strict=True)
    return mi.UInt32(list(numbers)), mi.Float(list(across)), mi.Float(list(down)), mi.Float(list(part))


def _branches(present: int | None) -> list[tuple[int, int]]:
    """Return the kinds of rays into which surfaces of these flags split, with the kinds that rule each out."""
    kinds, diffuse = mi.BSDFFlags, int(mi.BSDFFlags.Diffuse)
    split = [(int(kind), 0) for kind in (kinds.DeltaReflection, kinds.DeltaTransmission, kinds.Null)]
    # A glossy surface is followed near its mirror image, unless it is diffuse too: then the lamps alone light it.
    split += [(int(kind), diffuse) for kind in (kinds.GlossyReflection, kinds.GlossyTransmission)]
    return [(kind, without) for kind, without in split if present is None or present & kind]


@dr.syntax
def _trace(
    scene: mi.Scene, lamps: Any, branches: list[Any], ray: mi.Ray3f, depth: int, active: mi.Bool, lets_pass: bool
) -> Any:
    room = depth * max(len(branches) - 1, 0) + 2
    origins = dr.alloc_local(mi.Point3f, room)
    directions = dr.alloc_local(mi.Vector3f, room)
    weights = dr.alloc_local(mi.Color3f, room)
    levels = dr.alloc_local(mi.UInt32, room)
    origins.write(ray.o, mi.UInt32(0))
    directions.write(ray.d, mi.UInt32(0))
    weights.write(mi.Color3f(1), mi.UInt32(0))
    levels.write(mi.UInt32(0), mi.UInt32(0))
    waiting = dr.select(active, mi.UInt32(1), mi.UInt32(0))
    light = mi.Color3f(0)

    while waiting > 0:
        waiting -= 1
        weight, level = weights.read(waiting), levels.read(waiting)
        there = mi.Ray3f(origins.read(waiting), directions.read(waiting))
        found = scene.ray_intersect(there)
        bsdf = found.bsdf(mi.RayDifferential3f(there))
        light += weight * found.emitter(scene).eval(found)
        hit = found.is_valid()
        if dr.hint(lamps is not None, mode="scalar"):
            light += weight * _direct(scene, lamps, found, bsdf, hit, depth if lets_pass else 0)

        for kind, without in branches:
            flags = bsdf.flags()
            follow = hit & (level < depth) & ((flags & kind) != 0) & ((flags & without) == 0)
            direction, part = _step(bsdf, found, there.d, kind, follow, lets_pass)
            carried = weight * part
            follow &= dr.max(carried) > LEAST_WEIGHT
            onward = found.spawn_ray(direction)
            origins.write(onward.o, waiting, follow)
            directions.write(onward.d, waiting, follow)
            weights.write(carried, waiting, follow)
            levels.write(level + 1, waiting, follow)
            waiting = dr.select(follow, waiting + 1, waiting)

    return light


def _step(bsdf: Any, found: Any, ahead: Any, kind: int, active: Any, lets_pass: bool) -> tuple[Any, Any]:
    """Return the direction of a branch, and the part of the light that comes from there.

    Where a surface has open parts, Mitsuba does not sample one kind alone. So the open part goes straight on by what it
    lets pass, and the rest of the surface by a sample of all kinds, which counts if it is of this kind.
    """
    half = mi.Point2f(0.5, 0.5)
    context = mi.BSDFContext(mi.TransportMode.Radiance, kind)
    if not lets_pass:
        step, part = bsdf.sample(context, found, mi.Float(0.5), half, active)
        return found.to_world(step.wo), part
    is_open = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)
    open_part = bsdf.eval_null_transmission(found, is_open)
    if kind == int(mi.BSDFFlags.Null):
        return ahead, open_part
    step, part = bsdf.sample(context, found, mi.Float(0.5), half, active & ~is_open)
    rest = 1 - dr.mean(open_part)
    some, some_part = bsdf.sample(mi.BSDFContext(), found, 0.5 * rest, half, is_open)
    is_of_kind = is_open & ((some.sampled_type & kind) != 0)
    direction = dr.select(is_open, some.wo, step.wo)
    return found.to_world(direction), dr.select(is_open, dr.select(is_of_kind, some_part * rest, 0), part)


@dr.syntax
def _direct(scene: mi.Scene, lamps: Any, found: Any, bsdf: Any, hit: Any, most: int) -> Any:
    """Return the light of all lamps that a surface sends back along the ray, through `most` clear surfaces."""
    numbers, across, down, parts = lamps
    all_lamps = scene.emitters_dr()
    context = mi.BSDFContext()
    lit = hit & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
    glossy_alone = (bsdf.flags() & int(mi.BSDFFlags.Diffuse)) == 0
    light, shadow_ray = mi.Color3f(0), mi.UInt32(0)
    while shadow_ray < dr.width(numbers):
        lamp = dr.gather(mi.EmitterPtr, all_lamps, dr.gather(mi.UInt32, numbers, shadow_ray))
        place = mi.Point2f(dr.gather(mi.Float, across, shadow_ray), dr.gather(mi.Float, down, shadow_ray))
        towards, radiance = lamp.sample_direction(found, place, lit)
        # The branch of a glossy surface sees lamps with an extent itself.
        seen = lit & (towards.pdf > 0) & (towards.delta | ~glossy_alone)
        value = bsdf.eval(context, found, found.to_local(towards.d), seen)
        seen &= dr.max(value * radiance) > 0
        part = dr.gather(mi.Float, parts, shadow_ray)
        if dr.hint(most > 0, mode="scalar"):
            passed = passing(scene, found, towards.p, seen, most)
            light += dr.select(seen, value * radiance * part * passed, 0)
        else:
            seen &= ~scene.ray_test(found.spawn_ray_to(towards.p), seen)
            light += dr.select(seen, value * radiance * part, 0)
        shadow_ray += 1
    return light
