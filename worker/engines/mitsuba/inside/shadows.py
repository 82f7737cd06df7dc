"""The light along shadow rays, which go straight through clear surfaces, tinted by them, and through open masks.

As in POV-Ray, a shadow ray is not bent: glass casts a bright shadow in its own colour and no caustic. At each clear
surface it keeps what Fresnel's equations let pass from the outer side at its angle, so that a pane of glass passes the
same light whichever of its sides comes first. Rough glass stops it.
"""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import Any

import drjit as dr
import mitsuba as mi


def present_flags(scene: mi.Scene) -> int | None:
    """Return the flags of all surfaces of a scene together; None if there are groups, whose surfaces are not listed."""
    shapes = scene.shapes()
    if any(shape.class_name() == "Instance" for shape in shapes):
        return None
    return reduce(or_, (int(shape.bsdf().flags()) for shape in shapes), 0)


@dr.syntax
def passing(scene: mi.Scene, found: Any, lamp_place: Any, active: Any, most: int) -> Any:
    """Return the part of the light of lamps that reaches surfaces, `mi.Color3f`, 0 to 1.

    Parameters
    ----------
    scene
        The scene.
    found
        The surfaces.
    lamp_place
        The places of the lamps.
    active
        The surfaces that are asked for.
    most
        The greatest number of clear surfaces; behind them it is dark.
    """
    part = dr.select(active, mi.Color3f(1), mi.Color3f(0))
    ray = mi.Ray3f(found.spawn_ray_to(lamp_place))
    going, passed = mi.Bool(active), mi.UInt32(0)
    while going:
        hit = scene.ray_intersect(ray, going)
        going &= hit.is_valid()
        part = dr.select(going, part * _passed_at(hit, ray, going), part)
        passed += 1
        part = dr.select(going & (passed > most), mi.Color3f(0), part)
        going &= dr.max(part) > 0
        ray = mi.Ray3f(hit.spawn_ray_to(lamp_place))
    return part


def _passed_at(hit: Any, ray: Any, active: Any) -> Any:
    """Return the part of the light that passes a surface straight on, `mi.Color3f`."""
    bsdf = hit.bsdf(mi.RayDifferential3f(ray))
    flags = bsdf.flags()
    has_open_parts = active & mi.has_flag(flags, mi.BSDFFlags.Null)
    is_clear = active & mi.has_flag(flags, mi.BSDFFlags.DeltaTransmission) & ~has_open_parts
    open_part = bsdf.eval_null_transmission(hit, has_open_parts)
    outer = mi.SurfaceInteraction3f(hit)
    outer.wi = mi.Vector3f(hit.wi.x, hit.wi.y, dr.abs(hit.wi.z))
    # Importance: radiance is scaled by the square of the index, and back where the ray leaves the glass.
    context = mi.BSDFContext(mi.TransportMode.Importance, int(mi.BSDFFlags.DeltaTransmission))
    _, clear_part = bsdf.sample(context, outer, mi.Float(0.5), mi.Point2f(0.5, 0.5), is_clear)
    return dr.select(has_open_parts, open_part, dr.select(is_clear, clear_part, mi.Color3f(0)))
