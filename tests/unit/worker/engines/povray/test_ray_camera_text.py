"""The text of a ray camera says the rays again, when it is read as POV-Ray reads it."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.errors import RenderFailed
from lippmann.optics.lens.trace import Rays, unit
from worker.engines.povray.ray_camera import FIGURES, face_codes, ray_camera_region, ray_camera_text, scaffold

Array = NDArray[np.float64]

FRONT_MM = -3.0


def bundle(*, rows: int = 7, cols: int = 11, width_mm: float = 200.0, slope: float = 0.2, seed: int = 1) -> Rays:
    """Return rays toward -z that start anywhere."""
    noise = np.random.default_rng(seed)
    position = noise.uniform(-width_mm / 2, width_mm / 2, (rows, cols, 3)) + np.array([30.0, -20.0, 500.0])
    direction = np.concatenate([noise.uniform(-slope, slope, (rows, cols, 2)), -np.ones((rows, cols, 1))], axis=-1)
    return Rays(position, unit(direction))


def included(rays: Rays, *, mm_per_unit: float = 1.0) -> bytes:
    return b"".join(
        ray_camera_text([rays], rays.position[..., 0].size, scaffold(rays, front_mm=FRONT_MM, mm_per_unit=mm_per_unit))
    )


def read_rays(text: bytes) -> tuple[Array, Array]:
    """Return centroids and normals of the faces, each (face, 3), mm: the file as POV-Ray reads it, in 32-bit floats."""
    words = text.decode()
    vertices_text = words.split("vertex_vectors {")[1].split("}")[0]
    step, *origin = map(float, re.findall(r"scale (\S+) translate <(.*), (.*), (.*)>", words)[0])
    numbers = re.findall(r"<(.*?)>|(\d+)", vertices_text.split(",", 1)[1])
    codes = [re.split(r"[ ,]+", vector) if vector else [height] * 3 for vector, height in numbers]
    vertices = np.array(codes, np.float32)
    factor = np.array([float(part) for part in re.findall(r"F = <(.*), (.*), (.*)>;", words)[0]])
    turns = np.array(re.findall(r"F\*(\d+)", words), float)
    faces = (turns[:, np.newaxis] * factor).astype(int)
    assert f"vertex_vectors {{ {len(vertices)}," in words
    assert f"face_indices {{ {len(faces)}," in words
    first, second, third = (vertices[faces[:, corner]].astype(float) for corner in range(3))
    mesh = np.array([[1, 0, 0], [0, 1, 0], [-1, -1, 1]])
    # POV-Ray's normal, taken in the mesh's own frame and turned like one: by the inverse transposed.
    normal = np.cross(third - first, second - first).astype(np.float32) @ np.linalg.inv(mesh).T
    centroid = (first + second + third).astype(np.float32) / 3
    return centroid @ mesh * step + origin, unit(normal.astype(float))


@pytest.mark.parametrize(
    ("width_mm", "slope"), [(200.0, 0.2), (200.0, 0.0), (200.0, 0.6), (0.5, 0.2), (0.0, 0.1), (2000.0, 0.1)]
)
def test_every_face_is_its_ray(width_mm: float, slope: float) -> None:
    rays = bundle(width_mm=width_mm, slope=slope)
    start, direction = read_rays(included(rays))
    assert np.abs(direction - rays.direction.reshape(-1, 3)).max() < 2e-6
    on_ray = rays.at_z(start[:, 2].reshape(rays.position.shape[:2])).reshape(-1, 3)
    assert np.abs(start - on_ray).max() < max(1e-3, 1e-6 * width_mm)


@pytest.mark.parametrize("slope", [0.0, 0.2, 0.6])
def test_no_ray_starts_before_the_front(slope: float) -> None:
    start, _ = read_rays(included(bundle(slope=slope)))
    behind = start[:, 2] - FRONT_MM
    assert -1e-3 <= behind.min() <= 0.3 * behind.max() + 1e-3


def test_a_single_ray_is_a_face() -> None:
    rays = bundle(rows=1, cols=1)
    _, direction = read_rays(included(rays))
    assert np.abs(direction - rays.direction.reshape(-1, 3)).max() < 2e-6


@pytest.mark.parametrize("mm_per_unit", [0.01, 1.0, 1000.0])
def test_dead_rays_start_inside_the_blind_ball_and_behind_all_others(mm_per_unit: float) -> None:
    rays = bundle()
    rays.direction[2, 3:] = np.nan
    dead = np.isnan(rays.direction[..., 2]).reshape(-1)
    text = included(rays, mm_per_unit=mm_per_unit)
    start, direction = read_rays(text)
    x, y, z, radius_mm = map(float, re.findall(rb"sphere \{ <(.*), (.*), (.*)>, (\S+) ", text)[0])
    assert np.linalg.norm(start[dead] - [x, y, z], axis=-1).max() < 0.1 * radius_mm
    assert start[~dead][:, 2].max() < z - radius_mm
    assert radius_mm / mm_per_unit >= 0.01
    assert np.abs(direction[~dead] - rays.direction.reshape(-1, 3)[~dead]).max() < 2e-6


def test_rays_that_are_all_dead_have_a_place_too() -> None:
    rays = bundle(rows=2, cols=2)
    rays.direction[:] = np.nan
    start, direction = read_rays(included(rays))
    assert np.isfinite(start).all()
    assert np.isfinite(direction).all()


def test_nothing_is_blind_where_all_rays_live() -> None:
    assert b"Lippmann_Blind" not in included(bundle())


def test_coordinates_are_whole_positive_numbers_of_one_width() -> None:
    text = included(bundle()).decode()
    lines = text.split("vertex_vectors {")[1].split("}")[0].strip().split("\n")[1:]
    assert all(
        re.fullmatch(rf"\d{{{FIGURES}}}<\d{{{FIGURES}}} \d{{{FIGURES}}} \d{{{FIGURES}}}>", line) for line in lines
    )


def test_the_picture_has_a_row_more_above() -> None:
    assert ray_camera_region(rows=480, cols=640) == (1, 481, 0, 640)


def test_a_pixel_has_the_same_face_in_whatever_tile_it_is() -> None:
    rays = bundle()
    shared = scaffold(rays, front_mm=FRONT_MM, mm_per_unit=1.0)
    part = Rays(rays.position[2:5, 3:], rays.direction[2:5, 3:])
    whole, _ = face_codes(rays, shared)
    tile, _ = face_codes(part, shared)
    assert (tile.reshape(3, 8, 4) == whole.reshape(7, 11, 4)[2:5, 3:]).all()


def test_rays_outside_the_scaffold_are_refused() -> None:
    shared = scaffold(bundle(width_mm=10.0), front_mm=FRONT_MM, mm_per_unit=1.0)
    with pytest.raises(RenderFailed, match="outside"):
        list(ray_camera_text([bundle(width_mm=2000.0)], 77, shared))
