"""Gaussian splats as a scene of Mitsuba, and the light that rays receive from them.

A splat is a hull around a Gaussian. A ray visits the hulls by the distance of their near side and composites front to
back: at the peak of the Gaussian along the ray, alpha = opacity * exp(-d^2 / 2), as in Moenne-Loccoz et al., "3D
Gaussian Ray Tracing" (2024), and as the integrator `volprim_rf_basic` of Mitsuba does, which has neither a distance
nor a step that follows the size of the scene.

The hull is the shape `ellipsoidsmesh`, icosahedra. The shape `ellipsoids` is not used: in float32 it misses 19 % of the
rays through a Gaussian that is 100 times as wide as thick, from 10 standard deviations away.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import drjit
import mitsuba

from lippmann.errors import SceneError
from worker.engines.mitsuba.inside.scenes.splat_file import Splats, is_splats, read_splats

__all__ = ["SplatLight", "is_splats", "load_splats", "radiance", "splat_scene"]

dr: Any = drjit
mi: Any = mitsuba
"""Without types, because those of the stubs are not those of a variant."""

MAX_HITS = 2048
"""The greatest number of splats along one ray."""
LEAST_TRANSMITTANCE = 1 / 512
"""The transmittance at which a ray ends; half a step of 8 bits."""
FAINTEST = 1 / 255
"""The smallest opacity of a splat that is kept; fainter ones change no pixel by a step of 8 bits."""
_EXTENT = 3.0
"""The size of a hull in standard deviations; the response there is 1.1 %."""
_STEP = 4e-7
"""The share of the coordinates by which a ray passes the near side of a hull: some steps of float32."""


@dataclass(frozen=True)
class SplatLight:
    """What rays receive from splats."""

    radiance: Any
    """The `mi.Color3f` of linear light, linear sRGB primaries."""
    distance: Any
    """The `mi.Float` of the distance at which half of the light is stopped, in units of the scene; infinite where more
    than half passes through all splats."""
    opacity: Any
    """The `mi.Float` of the stopped share of the light, 0 to 1."""


def load_splats(path: Path, note: Callable[[str], None] = lambda text: None) -> Any:
    """Return the `mi.Scene` of a .ply of Gaussian splats; `radiance` renders it.

    Parameters
    ----------
    path
        The file.
    note
        The function that takes a sentence about what was left out or changed.

    Raises
    ------
    SceneError
        See `splat_file.read_splats`; or no splat of the file is visible.
    """
    splats = read_splats(path)
    faint = int((splats.opacities < FAINTEST).sum())
    if faint == len(splats):
        raise SceneError(f"{path.name}: expected a splat with an opacity of {FAINTEST:.4f} or more, got none")
    if faint:
        note(f"{path.name}: {faint:,} of {len(splats):,} splats are fainter than 1/255 and left out")
    if splats.thickened:
        note(
            f"{path.name}: {splats.thickened:,} of {len(splats):,} splats are thickened to a thousandth of their width"
        )
    return splat_scene(splats)


def splat_scene(splats: Splats) -> Any:
    """Return the `mi.Scene` of splats, with attributes `opacities` and `sh_coeffs`; the faintest are left out."""
    kept = splats.opacities >= FAINTEST
    return mi.load_dict(
        {
            "type": "scene",
            "splats": {
                "type": "ellipsoidsmesh",
                "shell": "ico_sphere",
                "centers": mi.TensorXf(splats.centers[kept]),
                "scales": mi.TensorXf(splats.sigmas[kept]),
                "quaternions": mi.TensorXf(splats.quaternions[kept]),
                "opacities": mi.TensorXf(splats.opacities[kept, None]),
                "sh_coeffs": mi.TensorXf(splats.harmonics[kept].reshape(int(kept.sum()), -1)),
                "extent": _EXTENT,
            },
        }
    )


@drjit.syntax
def radiance(scene: Any, rays: Any, active: Any = True) -> SplatLight:
    """Return the light that rays receive from the splats of a scene.

    The colours of splats are trained on pictures as they are stored, so they are composited as they are and the sum is
    converted from sRGB to linear light, once.

    Parameters
    ----------
    scene
        The `mi.Scene` of `load_splats`.
    rays
        The `mi.Ray3f`; their directions have length 1.
    active
        The `mi.Bool` of the rays that are traced; the others receive nothing.
    """
    shape = scene.shapes()[0]
    basis = dr.sh_eval(rays.d, _degree(shape))
    exists = mi.Bool(active) & dr.isfinite(dr.sum(rays.o) + dr.sum(rays.d))
    # Near the splats, float32 tells their near sides apart.
    box = scene.bbox()
    inside, entry, _ = mi.BoundingBox3f(mi.Point3f(box.min), mi.Point3f(box.max)).ray_intersect(rays)
    entry = dr.select(exists & inside, dr.maximum(0.999 * entry, 0), 0)
    start = mi.Point3f(rays.o + entry * rays.d)
    travelled = mi.Float(0)
    light = mi.Color3f(0)
    transmittance = mi.Float(1)
    distance = mi.Float(dr.inf)
    hits = mi.UInt32(0)
    last = mi.UInt32(0xFFFFFFFF)
    going = exists & inside
    while dr.hint(going, label="splats"):
        ray = mi.Ray3f(start + travelled * rays.d, rays.d)
        hit = scene.ray_intersect(ray, +mi.RayFlags.Minimal, False, active=going)
        going &= hit.is_valid()
        near = travelled + dr.select(going, hit.t, 0)
        at_hull = mi.Point3f(start + near * rays.d)
        is_new = going & (hit.prim_index != last)
        alpha, peak = _response(shape, hit.prim_index, at_hull, rays.d, is_new)
        light += transmittance * alpha * _colour(shape, hit.prim_index, basis, is_new)
        remains = transmittance * (1 - alpha)
        distance = dr.select((transmittance > 0.5) & (remains <= 0.5), entry + near + peak, distance)
        transmittance = remains
        last = dr.select(going, hit.prim_index, last)
        travelled = near + _STEP * dr.maximum(near, dr.max(dr.abs(at_hull)))
        hits += 1
        going &= (transmittance > LEAST_TRANSMITTANCE) & (hits < MAX_HITS)
    linear = mi.math.srgb_to_linear(dr.maximum(light, 0))
    return SplatLight(radiance=linear, distance=distance, opacity=1 - transmittance)


def _response(shape: Any, index: Any, near: Any, direction: Any, active: Any) -> tuple[Any, Any]:
    """Return the opacity of splats along rays, and the way from the points `near` to the peaks of the Gaussians."""
    place = dr.zeros(mi.SurfaceInteraction3f)
    place.prim_index = index
    data = shape.eval_attribute_x("ellipsoid", place, active)
    sigma = mi.Vector3f(data[3], data[4], data[5])
    to_own = dr.quat_to_matrix(mi.Matrix3f, mi.Quaternion4f(data[6], data[7], data[8], data[9])).T
    own_near = to_own @ mi.Vector3f(near - mi.Point3f(data[0], data[1], data[2])) / sigma
    own_direction = to_own @ direction / sigma
    peak = -dr.dot(own_near, own_direction) / dr.squared_norm(own_direction)
    opacity = shape.eval_attribute_1("opacities", place, active)
    alpha = opacity * dr.exp(-0.5 * dr.squared_norm(own_near + peak * own_direction))
    return dr.select(active, dr.minimum(alpha, 0.9999), 0), dr.select(active, peak, 0)


def _colour(shape: Any, index: Any, basis: list[Any], active: Any) -> Any:
    """Return the colours of splats as stored, seen along the directions of `basis`; at least 0."""
    place = dr.zeros(mi.SurfaceInteraction3f)
    place.prim_index = index
    data = shape.eval_attribute_x("sh_coeffs", place, active)
    colour = mi.Color3f(0.5)
    for number, value in enumerate(basis):
        colour += value * mi.Color3f(data[3 * number], data[3 * number + 1], data[3 * number + 2])
    return dr.select(active, dr.maximum(colour, 0), 0)


def _degree(shape: Any) -> int:
    """Return the degree of the spherical harmonics of the splats."""
    values = mi.traverse(shape)
    functions: int = dr.width(values["sh_coeffs"]) // (3 * dr.width(values["opacities"]))
    return math.isqrt(functions) - 1
