"""Light through clear surfaces and open masks: by Fresnel's equations, by the opacity, and never more than there is."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.unit.worker.engines.mitsuba.inside.test_shade import shaded

LAMP = np.array([200.0, 0.0, 200.0])


def lit_wall(mi: Any, make_request: Any, between: dict[str, Any] | None) -> dict[str, NDArray[np.float32]]:
    """Return a wall at z = 0 in the light of a lamp beside the rig, with something between the wall and the lamp."""
    scene = {
        "type": "scene",
        "wall": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(50)},
        "lamp": {"type": "point", "position": LAMP.tolist(), "intensity": 1e5},
        **({"between": between} if between else {}),
    }
    return shaded(mi, mi.load_dict(scene, optimize=False), make_request(channels=("position",)))


def part_of_light(mi: Any, make_request: Any, between: dict[str, Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the part of the lamp's light that reaches the wall, and the cosines at which it meets x = constant."""
    free = lit_wall(mi, make_request, None)
    shaded_wall = lit_wall(mi, make_request, between)
    seen = np.isfinite(free["position"][..., 0])
    towards = LAMP - (free["position"][seen] + (0, 0, 500))  # the rig stands 500 mm above the wall
    cosine = towards[:, 0] / np.linalg.norm(towards, axis=-1)
    return shaded_wall["radiance"][seen] / free["radiance"][seen], cosine


def across_x(mi: Any, kind: str, thickness: float) -> dict[str, Any]:
    """Return a shape of planes x = constant that all light of the lamp crosses and no ray of the rig."""
    stand = mi.ScalarTransform4f().translate([100.0, 0, 100])
    if kind == "rectangle":
        return {"type": kind, "to_world": stand.rotate([0, 1, 0], 90).scale([90, 300, 1])}
    return {"type": kind, "to_world": stand.scale([thickness / 2, 300, 90])}


def transmittance(cosine: NDArray[Any], index: float) -> NDArray[Any]:
    """Return what passes into glass by Fresnel's equations, for light that is not polarised."""
    inner = np.sqrt(1 - (1 - cosine**2) / index**2)
    across = ((cosine - index * inner) / (cosine + index * inner)) ** 2
    along = ((inner - index * cosine) / (inner + index * cosine)) ** 2
    return np.asarray(1 - (across + along) / 2)


@pytest.mark.parametrize("tint", [(1.0, 1.0, 1.0), (0.9, 0.5, 0.1)])
def test_a_pane_of_glass_passes_what_its_two_sides_pass(
    mi: Any, make_request: Any, tint: tuple[float, float, float]
) -> None:
    glass = {"type": "dielectric", "int_ior": 1.5, "specular_transmittance": {"type": "rgb", "value": list(tint)}}
    found, cosine = part_of_light(mi, make_request, {**across_x(mi, "cube", 4.0), "bsdf": glass})
    expected = transmittance(cosine, 1.5 / 1.000277)[:, np.newaxis] ** 2 * np.array(tint) ** 2
    assert 0.85 < expected.max() / max(tint) ** 2 < 0.95
    np.testing.assert_allclose(found, expected, rtol=2e-4)


def test_a_mask_passes_where_it_is_open(mi: Any, make_request: Any) -> None:
    leaf = {"type": "diffuse"}
    found, _ = part_of_light(
        mi, make_request, {**across_x(mi, "rectangle", 0), "bsdf": {"type": "mask", "opacity": 0.3, "leaf": leaf}}
    )
    np.testing.assert_allclose(found, 0.7, rtol=1e-5)
    checks = {
        "type": "checkerboard", "color0": 0.0, "color1": 1.0,
        "to_uv": mi.ScalarTransform4f().scale([45, 150, 1]),
    }  # fmt: skip
    found, _ = part_of_light(
        mi, make_request, {**across_x(mi, "rectangle", 0), "bsdf": {"type": "mask", "opacity": checks, "leaf": leaf}}
    )
    is_open = found[:, 0] > 0.5
    assert 0.2 < is_open.mean() < 0.8
    np.testing.assert_allclose(found, np.where(is_open, 1.0, 0.0)[:, np.newaxis].repeat(3, axis=1), atol=1e-5)


def test_what_is_opaque_or_rough_stops_all_light(mi: Any, make_request: Any) -> None:
    for bsdf in ({"type": "diffuse"}, {"type": "roughdielectric"}, {"type": "conductor"}):
        found, _ = part_of_light(mi, make_request, {**across_x(mi, "cube", 4.0), "bsdf": bsdf})
        assert (found == 0).all(), bsdf


@pytest.mark.parametrize("reflectance", [1.0, 0.5])
def test_a_half_open_mask_sends_back_and_lets_pass_what_there_is(
    mi: Any, make_request: Any, reflectance: float
) -> None:
    """In a furnace a mirror under a mask shows 0.7 through the mask and its own part of the rest."""
    mask = {"type": "mask", "opacity": 0.3, "inside": {"type": "conductor", "specular_reflectance": reflectance}}
    disk = {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(300), "bsdf": mask}
    scene = {"type": "scene", "disk": disk, "sky": {"type": "constant", "radiance": 1.0}}
    values = shaded(mi, mi.load_dict(scene, optimize=False), make_request(channels=("position",)))
    light = values["radiance"][np.isfinite(values["position"][..., 0])]
    np.testing.assert_allclose(light, 0.7 + 0.3 * reflectance, rtol=1e-4)
