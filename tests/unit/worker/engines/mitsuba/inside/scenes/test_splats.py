"""Rays through Gaussian splats against the formulas on paper."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import drjit
import mitsuba as mi
import numpy as np
import pytest

from lippmann.errors import SceneError
from tests.unit.worker.engines.mitsuba.inside.scenes.splat_text import write_splats
from tests.unit.worker.engines.mitsuba.inside.variant import variant_of_tests


@pytest.fixture(scope="module")
def splats() -> Any:
    mi.set_variant(variant_of_tests())
    from worker.engines.mitsuba.inside.scenes import splats

    return splats


def trace(splats: Any, file: Path, origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    directions = np.asarray(directions, float)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    origins = np.broadcast_to(np.asarray(origins, float), directions.shape)
    rays = mi.Ray3f(mi.Point3f(*origins.T.astype(np.float32)), mi.Vector3f(*directions.T.astype(np.float32)))
    light = splats.radiance(splats.load_splats(file), rays)
    return np.array(light.radiance).T, np.array(light.distance), np.array(light.opacity)


def to_linear(stored: Any) -> np.ndarray:
    stored = np.asarray(stored, float)
    linear: np.ndarray = np.where(stored <= 0.04045, stored / 12.92, ((stored + 0.055) / 1.055) ** 2.4)
    return linear


def fan(x: np.ndarray, z: float) -> np.ndarray:
    return np.stack([x, 0.3 * x, np.full_like(x, z)], axis=1)


def test_a_splat_covers_a_ray_by_the_peak_of_its_gaussian_along_the_ray(splats: Any, tmp_path: Path) -> None:
    file = write_splats(tmp_path / "one.ply", [[0, 0, 10]], [[1, 1, 1]], opacities=[0.9], colours=[[1, 0.5, 0.25]])
    targets = fan(np.linspace(-2.5, 2.5, 21), 10.0)
    light, distance, opacity = trace(splats, file, [0, 0, 0], targets)
    direction = targets / np.linalg.norm(targets, axis=1, keepdims=True)
    closest = np.linalg.norm(np.cross(direction, [0.0, 0, 10]), axis=1)
    alpha = 0.9 * np.exp(-0.5 * closest**2)
    np.testing.assert_allclose(opacity, alpha, atol=2e-5)
    np.testing.assert_allclose(light, to_linear(alpha[:, None] * [1, 0.5, 0.25]), atol=4e-5)
    np.testing.assert_allclose(distance[alpha > 0.5], (direction @ [0, 0, 10.0])[alpha > 0.5], rtol=1e-5)
    assert np.isinf(distance[alpha < 0.5]).all()


def test_the_silhouette_ends_at_the_hull(splats: Any, tmp_path: Path) -> None:
    file = write_splats(tmp_path / "one.ply", [[0, 0, 10]], [[1, 1, 1]], opacities=[0.99], colours=[[1, 1, 1]])
    _, _, opacity = trace(splats, file, [0, 0, 0], fan(np.array([0.0, 4.2, 6.0]), 10.0))
    assert opacity[0] == pytest.approx(0.99, abs=1e-5)
    assert (opacity[1:] == 0).all()


@pytest.mark.parametrize("order", [[0, 1], [1, 0]])
def test_overlapping_splats_are_composited_front_to_back(splats: Any, tmp_path: Path, order: list[int]) -> None:
    centers, colours = np.array([[0.0, 0, 10], [0.4, 0, 12]]), np.array([[1.0, 0.2, 0.1], [0.1, 0.4, 1.0]])
    alphas = np.array([0.4, 0.8])
    file = write_splats(
        tmp_path / "two.ply", centers[order], np.ones((2, 3)), opacities=alphas[order], colours=colours[order]
    )
    light, distance, opacity = trace(splats, file, [0, 0, 0], [[0, 0, 1.0]])
    front, back = 0.4, 0.8 * math.exp(-0.5 * 0.4**2)
    stored = front * colours[0] + (1 - front) * back * colours[1]
    assert opacity[0] == pytest.approx(1 - (1 - front) * (1 - back), abs=2e-5)
    np.testing.assert_allclose(light[0], to_linear(stored), atol=5e-5)
    assert distance[0] == pytest.approx(12, rel=1e-5)


def test_the_colour_depends_on_the_direction_by_harmonics_of_degree_one(splats: Any, tmp_path: Path) -> None:
    # Red has f_rest_0..2: the functions -y, z and -x of Kerbl et al.
    rest = np.zeros((1, 9))
    rest[0, :3], rest[0, 3], rest[0, 8] = [0.2, 0.3, -0.4], 0.5, 0.25
    file = write_splats(
        tmp_path / "sh.ply", [[0, 0, 0]], [[1, 1, 1]], opacities=[0.999], colours=[[0.5, 0.5, 0.5]], rest=rest
    )
    directions = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1], [0.6, 0, 0.8]])
    light, _, _ = trace(splats, file, -20 * directions, directions)
    x, y, z = directions.T
    red = 0.5 + 0.4886025 * (-y * 0.2 + z * 0.3 + x * 0.4)
    green, blue = 0.5 - 0.4886025 * y * 0.5, 0.5 - 0.4886025 * x * 0.25
    np.testing.assert_allclose(light, to_linear(0.999 * np.stack([red, green, blue], axis=1)), atol=1e-4)


def test_a_quaternion_with_w_first_turns_a_splat(splats: Any, tmp_path: Path) -> None:
    half = math.radians(30) / 2
    # The long axis x is turned about z by 30 degrees towards y.
    turned = [[math.cos(half), 0, 0, math.sin(half)]]
    file = write_splats(
        tmp_path / "long.ply", [[0, 0, 0]], [[2, 0.1, 0.1]], opacities=[0.9], colours=[[1, 1, 1]], rotations=turned
    )
    long = np.array([math.cos(2 * half), math.sin(2 * half), 0.0])
    across = np.array([-long[1], long[0], 0.0])
    points = np.stack([long, 2 * long, across * 0.1, across, -long])
    _, _, opacity = trace(splats, file, points - [0, 0, 20], np.tile([0.0, 0, 1], (5, 1)))
    expected = 0.9 * np.exp(-0.5 * np.array([0.25, 1, 1, 1e9, 0.25]))
    np.testing.assert_allclose(opacity, expected, atol=1e-4)


def test_a_flat_splat_is_hit_from_far_away_at_any_angle(splats: Any, tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    file = write_splats(tmp_path / "flat.ply", [[0, 0, 0]], [[1, 1, 1e-5]], opacities=[0.9], colours=[[1, 1, 1]])
    directions = random.normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions = directions[np.abs(directions[:, 2]) > 0.1]
    points = np.zeros_like(directions)
    points[:, :2] = random.uniform(-1, 1, (len(points), 2))
    _, distance, opacity = trace(splats, file, points - 300 * directions, directions)
    expected = 0.9 * np.exp(-0.5 * (points**2).sum(axis=1))
    np.testing.assert_allclose(opacity, expected, atol=0.01)
    np.testing.assert_allclose(distance[expected > 0.6], 300, rtol=1e-4)


def test_a_flat_splat_is_composited_once_at_any_angle(splats: Any, tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    file = write_splats(
        tmp_path / "flat.ply",
        [[10, 10, 10]],
        [[1, 1, 0.01]],
        opacities=[0.5],
        colours=[[1, 1, 1]],
        rotations=[[0.9, 0.1, 0.2, 0.3]],
    )
    directions = random.normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    points = random.uniform(8.5, 11.5, (20_000, 3))
    _, _, opacity = trace(splats, file, points - 5 * directions, directions)
    assert 0.49 < opacity.max() <= 0.5


def test_splats_near_each_other_are_told_apart_from_far_away(splats: Any, tmp_path: Path) -> None:
    centers = np.stack([np.zeros(50), np.zeros(50), 0.0005 * np.arange(50)], axis=1)
    file = write_splats(
        tmp_path / "sheets.ply",
        centers,
        np.tile([0.05, 0.05, 0.00005], (50, 1)),
        opacities=np.full(50, 0.03),
        colours=np.ones((50, 3)),
    )
    _, distance, opacity = trace(splats, file, [0, 0, -2000], [[0, 0, 1.0]])
    assert opacity[0] == pytest.approx(1 - 0.97**50, abs=1e-3)
    assert distance[0] == pytest.approx(2000, abs=0.03)


def test_many_sheets_are_each_composited_once(splats: Any, tmp_path: Path) -> None:
    count = 100
    centers = np.stack([np.zeros(count), np.zeros(count), 100 + 0.05 * np.arange(count)], axis=1)
    file = write_splats(
        tmp_path / "many.ply",
        centers,
        np.tile([3, 3, 0.001], (count, 1)),
        opacities=np.full(count, 0.03),
        colours=np.ones((count, 3)),
    )
    _, distance, opacity = trace(splats, file, [0, 0, 0], [[0, 0, 1.0]])
    assert opacity[0] == pytest.approx(1 - 0.97**count, abs=1e-4)
    crossed = math.ceil(math.log(0.5) / math.log(0.97)) - 1
    assert distance[0] == pytest.approx(centers[crossed, 2], abs=0.01)


@pytest.fixture(scope="module")
def cloud(splats: Any, tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any, np.ndarray]:
    """A scene of 60 splats with harmonics of degree 3, 400 rays to it from one point, and the directions."""
    random = np.random.default_rng(3)
    file = write_splats(
        tmp_path_factory.mktemp("cloud") / "cloud.ply",
        random.uniform(-1, 1, (60, 3)),
        random.uniform(0.05, 0.3, (60, 3)),
        opacities=random.uniform(0.2, 0.9, 60),
        colours=random.uniform(0, 1, (60, 3)),
        rotations=random.normal(size=(60, 4)),
        rest=random.normal(scale=0.05, size=(60, 45)),
    )
    directions = random.uniform(-1, 1, (400, 3)) - [0, 0, -6]
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    rays = mi.Ray3f(mi.Point3f(0, 0, -6), mi.Vector3f(*directions.T))
    return file, rays, directions


def test_every_splat_of_a_cloud_stops_its_share_once(splats: Any, cloud: tuple[Any, Any, np.ndarray]) -> None:
    file, rays, directions = cloud
    light = splats.radiance(splats.load_splats(file), rays)
    data = splats.read_splats(file)
    x, y, z, w = data.quaternions.T.astype(float)
    axes = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    ).transpose(2, 1, 0)
    own_start = np.einsum("sij,sj->si", axes, [0, 0, -6] - data.centers.astype(float)) / data.sigmas
    own_way = np.einsum("sij,rj->rsi", axes, directions.astype(float)) / data.sigmas
    peak = -(own_way * own_start).sum(-1) / (own_way**2).sum(-1)
    closest = ((own_start + peak[..., None] * own_way) ** 2).sum(-1)
    passed = np.prod(1 - data.opacities * np.exp(-0.5 * closest), axis=1)
    # The hulls cut the Gaussians off at three standard deviations or somewhat below.
    np.testing.assert_allclose(1 - np.array(light.opacity), passed, atol=0.03)


def test_the_light_agrees_with_mitsubas_own_integrator(splats: Any, cloud: tuple[Any, Any, np.ndarray]) -> None:
    file, rays, directions = cloud
    scene = splats.load_splats(file)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, len(directions))
    integrator = mi.load_dict({"type": "volprim_rf_basic", "max_depth": 512})
    own, *_ = integrator.sample(drjit.ADMode.Primal, scene, sampler, rays, None, None, True)
    difference = np.abs(np.array(splats.radiance(scene, rays).radiance) - np.array(own)).max(axis=0)
    # Mitsuba ends a ray at a transmittance of 1 %, and misses hulls within 1e-4 units of another.
    assert np.percentile(difference, 99) < 0.01
    assert (difference > 0.02).sum() <= 2


def test_rays_that_do_not_exist_receive_nothing(splats: Any, tmp_path: Path) -> None:
    file = write_splats(tmp_path / "one.ply", [[0, 0, 10]], [[1, 1, 1]], opacities=[0.9], colours=[[1, 1, 1]])
    scene = splats.load_splats(file)
    rays = mi.Ray3f(mi.Point3f([math.nan, 0], 0, 0), mi.Vector3f(0, 0, 1))
    light = splats.radiance(scene, rays)
    np.testing.assert_allclose(np.array(light.opacity), [0, 0.9], atol=1e-5)
    assert not splats.radiance(scene, rays, mi.Bool(False)).opacity[1]


def test_a_file_without_a_visible_splat_is_refused(splats: Any, tmp_path: Path) -> None:
    file = write_splats(tmp_path / "faint.ply", [[0, 0, 1]], [[1, 1, 1]], opacities=[0.001], colours=[[1, 1, 1]])
    with pytest.raises(SceneError, match="expected a splat with an opacity"):
        splats.load_splats(file)


def test_what_is_left_out_or_thickened_is_noted(splats: Any, tmp_path: Path) -> None:
    file = write_splats(
        tmp_path / "three.ply",
        [[0, 0, 10], [0, 0, 11], [0, 0, 12]],
        [[1, 1, 1], [1, 1, 1], [1, 1, 1e-5]],
        opacities=[0.9, 0.001, 0.9],
        colours=np.ones((3, 3)),
    )
    notes: list[str] = []
    splats.load_splats(file, notes.append)
    assert notes == [
        "three.ply: 1 of 3 splats are fainter than 1/255 and left out",
        "three.ply: 1 of 3 splats are thickened to a thousandth of their width",
    ]
