"""The rendering of a scene: places against the exact trace, light against known sums, the same bits in any order."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.optics.rig.bands import wavelength_bands
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.pixel_rays import pixel_rays
from worker.engines.mitsuba.inside.messages import Request

RIGS: dict[str, dict[str, Any]] = {
    "square": {},
    "hexagonal": {"lens_array": {"count": (6, 6), "lattice": "hexagonal"}},
    "perspective": {"camera": {"projection": "perspective"}},
    "direct": {"imaging_lens": None},
}


def shaded(mi: Any, scene: Any, request: Request) -> dict[str, NDArray[np.float32]]:
    from worker.engines.mitsuba.inside.shade import bands, shade_band

    parts = [shade_band(scene, request, rows) for rows in bands(request)]
    return {kind: np.concatenate([part[kind] for part in parts]).reshape(*request.shape, -1) for kind in request.kinds}


@pytest.fixture(scope="module")
def room(mi: Any) -> Any:
    """Return a scene with a diffuse floor, a mirror, glass and two lamps, in mm."""
    transform = mi.ScalarTransform4f
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.6, 0.5, 0.4]}}
    return mi.load_dict({
        "type": "scene",
        "wall": {"type": "rectangle", "to_world": transform().translate([0, 0, -60]).scale(400), "bsdf": grey},
        "glass": {"type": "sphere", "center": [-20, 0, 0], "radius": 25, "bsdf": {"type": "dielectric"}},
        "mirror": {"type": "sphere", "center": [30, 0, 0], "radius": 20, "bsdf": {"type": "conductor"}},
        "point": {"type": "point", "position": [80, 200, 300], "intensity": 2e5},
        "sky": {"type": "constant", "radiance": 0.2},
    })  # fmt: skip


@pytest.mark.parametrize("samples", [1, 3])
def test_tiles_threads_and_repeats_give_the_same_bits(mi: Any, room: Any, make_request: Any, samples: int) -> None:
    import drjit

    channels = ("depth", "normal", "albedo", "object", "position")
    whole = make_request(samples=samples, channels=channels)
    drjit.set_thread_count(2)
    first = shaded(mi, room, whole)
    drjit.set_thread_count(1)
    again = shaded(mi, room, whole)
    assert first["radiance"].std() > 0.01
    for kind, values in first.items():
        assert np.array_equal(values, again[kind], equal_nan=True), kind
    for region in [(0, 7, 0, 48), (7, 8, 0, 1), (13, 48, 5, 39)]:
        tile = shaded(mi, room, make_request(samples=samples, region=region, channels=channels))
        for kind, values in tile.items():
            expected = first[kind][region[0] : region[1], region[2] : region[3]]
            assert np.array_equal(values, expected, equal_nan=True), (kind, region)


@pytest.mark.parametrize("mm_per_unit", [0.01, 1.0, 1000.0])
@pytest.mark.parametrize("rig", RIGS)
def test_rays_hit_a_plane_where_the_exact_trace_says(mi: Any, make_request: Any, rig: str, mm_per_unit: float) -> None:
    request = make_request(mm_per_unit=mm_per_unit, channels=("position", "depth", "object"), rig=RIGS[rig])
    size = mi.ScalarTransform4f().scale(2000 / mm_per_unit)
    values = shaded(mi, mi.load_dict({"type": "scene", "plane": {"type": "rectangle", "to_world": size}}), request)

    rig_bench = bench(request.job.spec.rig, reference_mm=request.job.stage.reference_mm)
    rays = pixel_rays(rig_bench, rows=request.rows, cols=request.cols)
    expected = rays.at_z(-500.0)
    alive = ~np.isnan(expected[..., 0])
    assert alive.sum() > 100
    assert np.abs(values["position"] - expected)[alive].max() <= 0.001  # mm
    along = np.linalg.norm(expected - rays.position, axis=-1)
    assert np.abs(values["distance"][..., 0] - along)[alive].max() <= 0.001
    assert (values["object"][alive] == 1).all()
    assert np.isnan(values["distance"][~alive]).all()
    assert (values["radiance"][~alive] == 0).all()


def test_the_hit_itself_lies_where_the_exact_trace_says(mi: Any, make_request: Any) -> None:
    """A mesh whose vertices carry their position as colour: what the surface is, not where the ray is."""
    request = make_request(channels=("albedo",))
    mesh = mi.Mesh("coded", 4, 2, has_vertex_normals=False, has_vertex_texcoords=False)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [-250.0, -250, 0, 250, -250, 0, 250, 250, 0, -250, 250, 0]
    parameters["faces"] = [0, 1, 2, 0, 2, 3]
    parameters.update()
    props = {"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_place"}}
    mesh.add_attribute("vertex_place", 3, [0.0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0])
    mesh.set_bsdf(mi.load_dict(props))
    albedo = shaded(mi, mi.load_dict({"type": "scene", "mesh": mesh}), request)["albedo"]
    rig_bench = bench(request.job.spec.rig, reference_mm=request.job.stage.reference_mm)
    expected = pixel_rays(rig_bench, rows=request.rows, cols=request.cols).at_z(-500.0)
    alive = ~np.isnan(expected[..., 0])
    # The stage looks along -z with up y, so the axes of a right-handed scene are those of the rig.
    assert np.abs(albedo[..., :2] * 500.0 - 250.0 - expected[..., :2])[alive].max() <= 0.001


def test_only_diffuse_surfaces_have_an_albedo_and_it_is_at_most_one(mi: Any, make_request: Any) -> None:
    """Mitsuba's own estimate of what is not diffuse is the height of the highlight, 100 at this roughness."""
    colour = {"type": "rgb", "value": [0.2, 0.4, 0.6]}
    surfaces: dict[str, tuple[dict[str, Any], Any]] = {
        "roughconductor": ({"alpha": 0.05}, 0.0), "dielectric": ({}, 0.0),
        "principled": ({"base_color": colour, "metallic": 1.0}, [0.2, 0.4, 0.6]),
        "plastic": ({"diffuse_reflectance": colour}, [0.2, 0.4, 0.6]),
    }  # fmt: skip
    for kind, (more, expected) in surfaces.items():
        ball = {"type": "sphere", "radius": 60.0, "bsdf": {"type": kind, **more}}
        request = make_request(channels=("albedo", "object"), rig={"lens_array": {"count": (3, 3)}})
        values = shaded(mi, mi.load_dict({"type": "scene", "ball": ball}), request)
        hit = values["object"][..., 0] == 1
        assert np.allclose(values["albedo"][hit], expected), kind
        assert np.isnan(values["albedo"][~hit]).all()


def test_a_white_ball_in_a_white_furnace_is_not_seen(mi: Any, make_request: Any) -> None:
    scene = mi.load_dict({
        "type": "scene",
        "ball": {
            "type": "sphere", "radius": 60.0,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}},
        },
        "sky": {"type": "constant", "radiance": 1.0},
    })  # fmt: skip
    request = make_request(samples=16, path_depth=64, channels=("object",), rig={"lens_array": {"count": (3, 3)}})
    values = shaded(mi, scene, request)
    assert (values["object"] == 1).mean() > 0.2
    ball = values["radiance"][values["object"][..., 0] == 1]
    assert abs(ball.mean() - 1.0) < 0.005
    assert ball.std() < 0.15


def test_mirrors_and_glass_are_followed_without_noise(mi: Any, make_request: Any) -> None:
    """In a furnace a perfect mirror and clear glass send back what they receive."""
    for bsdf in ({"type": "conductor", "material": "none"}, {"type": "dielectric"}, {"type": "thindielectric"}):
        ball = {"type": "sphere", "radius": 60.0, "bsdf": bsdf}
        sky = {"type": "constant", "radiance": 1.0}
        request = make_request(path_depth=16, channels=("object",))
        values = shaded(mi, mi.load_dict({"type": "scene", "ball": ball, "sky": sky}), request)
        hit = values["object"][..., 0] == 1
        assert hit.mean() > 0.2
        assert np.allclose(values["radiance"][hit], 1.0, atol=0.02), bsdf


def test_mirrors_inside_a_group_are_followed(mi: Any, make_request: Any) -> None:
    ball = {"type": "sphere", "radius": 60.0, "bsdf": {"type": "conductor", "material": "none"}}
    group = {"type": "shapegroup", "ball": ball}
    one = {"type": "instance", "group": {"type": "ref", "id": "group"}}
    scene = {"type": "scene", "group": group, "one": one, "sky": {"type": "constant", "radiance": 1.0}}
    values = shaded(mi, mi.load_dict(scene, optimize=False), make_request(channels=("object",)))
    hit = values["object"][..., 0] == 1
    assert hit.mean() > 0.2
    assert np.allclose(values["radiance"][hit], 1.0, atol=0.02)


def test_a_point_lamp_lights_by_the_law_of_the_cosine(mi: Any, make_request: Any) -> None:
    scene = mi.load_dict({
        "type": "scene",
        "wall": {
            "type": "rectangle", "to_world": mi.ScalarTransform4f().scale(400),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}},
        },
        "lamp": {"type": "point", "position": [0, 0, 100.0], "intensity": 1e4},
    })  # fmt: skip
    whitted = shaded(mi, scene, make_request(channels=("position",)))
    position = whitted["position"].astype(float)
    alive = np.isfinite(position[..., 0])
    away = np.hypot(np.hypot(position[..., 0], position[..., 1]), 100.0)
    expected = 0.5 / np.pi * 1e4 * 100.0 / away**3
    assert np.allclose(whitted["radiance"][..., 0][alive], expected[alive], rtol=1e-4)
    # The samples lie elsewhere in the pixel, and the light is smooth: paths agree with it.
    paths = shaded(mi, scene, make_request(samples=16))
    assert np.allclose(paths["radiance"][..., 0][alive], expected[alive], rtol=0.02)


def test_a_clamp_bounds_each_sample_and_keeps_its_colour(mi: Any, make_request: Any) -> None:
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": [8.0, 4.0, 2.0]}}
    values = shaded(mi, mi.load_dict({"type": "scene", "sky": sky}), make_request(clamp=2.0))
    lit = values["radiance"].max(axis=-1) > 0
    assert np.allclose(values["radiance"][lit], [2.0, 1.0, 0.5])


def test_the_samples_of_a_pixel_lie_inside_it_and_under_its_lens(mi: Any, make_request: Any) -> None:
    from lippmann.optics.rig import array as lattice
    from lippmann.optics.rig.bench import pixel_centres_mm
    from worker.engines.mitsuba.inside.rays import Pixels

    for rig in ("square", "hexagonal"):
        request = make_request(samples=16, rig=RIGS[rig])
        rig_bench = bench(request.job.spec.rig, reference_mm=500)
        centres = pixel_centres_mm(rig_bench).reshape(-1, 2)
        own = lattice.nearest_centre_mm(request.job.spec.rig.lens_array, centres)
        half = np.array([rig_bench.width_mm / request.cols, rig_bench.height_mm / request.rows]) / 2
        pixels = Pixels.of(rig_bench, request, range(request.rows))
        points = [np.stack(pixels.sample_places(rig_bench, request, k), axis=-1) for k in range(16)]
        for place in points:
            assert (np.abs(place - centres) <= half * (1 + 1e-9)).all()
            assert (lattice.nearest_centre_mm(request.job.spec.rig.lens_array, place) == own).all()
        if rig == "square":
            # Stratified: every sixteenth of the pixel's width has one sample, so their mean is near the centre.
            mean = np.mean(points, axis=0) - centres
            assert np.abs(mean / half).max() <= 0.2


def test_splats_have_light_and_distance_and_no_surfaces(mi: Any, make_request: Any) -> None:
    from worker.engines.mitsuba.inside.messages import UnsupportedError
    from worker.engines.mitsuba.inside.scenes.splat_file import Splats
    from worker.engines.mitsuba.inside.scenes.splats import splat_scene

    one = np.ones(1, np.float32)
    scene = splat_scene(
        Splats(
            centers=np.zeros((1, 3), np.float32), sigmas=np.full((1, 3), 5.0, np.float32),
            quaternions=np.array([[0, 0, 0, 1]], np.float32), opacities=0.9 * one,
            harmonics=np.ones((1, 1, 3), np.float32),
        )
    )  # fmt: skip
    values = shaded(mi, scene, make_request(channels=("depth",)))
    seen = np.isfinite(values["distance"][..., 0])
    assert 0.02 < seen.mean() < 0.9
    assert abs(np.median(values["distance"][seen]) - 500) < 80  # mm
    assert values["radiance"][seen].min() > 0.1
    with pytest.raises(UnsupportedError, match="Splats have no channel normal"):
        shaded(mi, scene, make_request(channels=("normal",)))


@pytest.mark.parametrize("samples", [1, 2])
def test_a_dispersing_rig_adds_what_each_wavelength_band_sees(mi: Any, make_request: Any, samples: int) -> None:
    """A plane that shines with its own place as colour: each band sees another place, and weighs it."""
    glass = {"surfaces": [
        {"radius_mm": 80.0, "thickness_mm": 10.0, "index": 1.6, "abbe": 20.0, "semi_aperture_mm": 30.0},
        {"radius_mm": None, "index": 1.0, "semi_aperture_mm": 30.0},
    ]}  # fmt: skip
    request = make_request(rig={"imaging_lens": glass, "dispersion": True}, samples=samples)
    properties = mi.Properties()
    properties["lamp"] = mi.load_dict({"type": "area", "radiance": {"type": "mesh_attribute", "name": "vertex_place"}})
    mesh = mi.Mesh("coded", 4, 2, properties, has_vertex_normals=False, has_vertex_texcoords=False)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [-250.0, -250, 0, 250, -250, 0, 250, 250, 0, -250, 250, 0]
    parameters["faces"] = [0, 1, 2, 0, 2, 3]
    parameters.update()
    mesh.add_attribute("vertex_place", 3, [0.0, 0, 0, 1, 0, 1, 1, 1, 1, 0, 1, 0])  # (x, y, x)
    found = shaded(mi, mi.load_dict({"type": "scene", "mesh": mesh}), request)["radiance"]

    rig_bench = bench(request.job.spec.rig, reference_mm=request.job.stage.reference_mm)
    spectrum = wavelength_bands(rig_bench, request.job.spec.capture.bands)
    places = [pixel_rays(band.bench, rows=request.rows, cols=request.cols).at_z(-500.0) for band in spectrum]
    apart_mm = np.linalg.norm(places[0] - places[-1], axis=-1)
    assert np.nanmax(apart_mm) > 5
    light = np.stack([(places[k] / 500.0 + 0.5)[..., (0, 1, 0)] * band.weights for k, band in enumerate(spectrum)])
    alive = np.isfinite(light).all(axis=(0, -1)) & (np.abs(np.array(places)[..., :2]) < 240).all(axis=(0, -1))
    assert alive.sum() > 100
    off = np.abs(found - light.sum(axis=0))[alive]
    if samples == 1:
        assert off.max() <= 1e-5
    else:  # They lie beside the centre of the pixel, on both sides, and at the rim of the lens one may be dead.
        assert np.median(off) <= 0.005
