"""Path tracing: light by next-event estimation and by the direction of the surface, weighted by the power heuristic.

Every ray has its own generator of random numbers, so that its light does not depend on the other rays.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

ROULETTE_DEPTH = 5
"""The bounces after which paths end by chance, in proportion to what they still carry."""


@dr.syntax
def path_radiance(scene: mi.Scene, ray: mi.RayDifferential3f, random: mi.PCG32, depth: int, active: mi.Bool) -> Any:
    """Return the radiance along rays by one path of each, linear RGB.

    Parameters
    ----------
    scene
        The scene.
    ray
        The rays, scene units.
    random
        A generator of random numbers for each ray.
    depth
        The greatest number of bounces.
    active
        The rays that are traced.
    """
    ray = mi.Ray3f(ray)
    active = mi.Bool(active)
    bsdf_context = mi.BSDFContext()
    light, weight, bounces = mi.Color3f(0), mi.Color3f(1), mi.UInt32(0)
    before, before_pdf, before_delta = dr.zeros(mi.Interaction3f), mi.Float(1), mi.Bool(True)

    while active:
        found = scene.ray_intersect(ray, active)
        bsdf = found.bsdf(mi.RayDifferential3f(ray))

        towards = mi.DirectionSample3f(scene, found, before)
        emitter_pdf = scene.pdf_emitter_direction(before, towards, ~before_delta)
        emitted = found.emitter(scene, active).eval(found, active)
        light += dr.select(active, weight * _share(before_pdf, emitter_pdf) * emitted, 0)

        going = active & found.is_valid() & (bounces < depth)
        lit = going & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        first, second = random.next_float32(), random.next_float32()
        lamp, lamp_weight = scene.sample_emitter_direction(found, mi.Point2f(first, second), True, lit)
        lit &= lamp.pdf != 0.0
        to_lamp = found.to_local(lamp.d)
        value, value_pdf = bsdf.eval_pdf(bsdf_context, found, to_lamp, lit)
        lamp_share = dr.select(lamp.delta, 1, _share(lamp.pdf, value_pdf))
        light += dr.select(lit, weight * lamp_share * value * lamp_weight, 0)

        component, first, second = random.next_float32(), random.next_float32(), random.next_float32()
        step, step_weight = bsdf.sample(bsdf_context, found, component, mi.Point2f(first, second), going)
        ray = found.spawn_ray(found.to_world(step.wo))
        weight = dr.select(going, weight * step_weight, 0)
        before = mi.Interaction3f(found)
        before_pdf = step.pdf
        before_delta = mi.has_flag(step.sampled_type, mi.BSDFFlags.Delta)
        bounces += 1

        most = dr.max(weight)
        chance = dr.select(bounces > ROULETTE_DEPTH, dr.minimum(most, 0.95), 1)
        survives = random.next_float32() < chance
        weight /= dr.maximum(chance, 1e-8)
        active = going & survives & (most > 0)

    return light


def _share(pdf: Any, other: Any) -> Any:
    """Return the power heuristic of one density against another."""
    share = dr.square(pdf) / (dr.square(pdf) + dr.square(other))
    return dr.select(dr.isfinite(share), share, 0)
