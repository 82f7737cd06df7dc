"""Rays given to the real POV-Ray: each pixel sees along its own, whatever the scale of the scene."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.spec import JobSpec
from lippmann.optics.lens.trace import Rays
from lippmann.optics.rig.bench import bench
from lippmann.optics.rig.pixel_rays import pixel_rays
from povtemplates.catalogue import INCLUDE_FOLDER
from tests.builders import local_place, rendered, small_job, stored_job
from tests.integration.povray.conftest import Room
from worker.engines.povray.pictures.pixels import read_codes
from worker.engines.povray.ray_camera import ray_camera_region, ray_camera_text, scaffold
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb

HALF_WIDTH_MM = 200.0
MEDIAN_MM = 0.02
LARGEST_MM = 0.1
AGREEMENT_DB = 45.0

STAGE = "<0, 0, 0>, z, y"
"""Surface 1 at the origin, looking along +z: the point (x, y, z) of the rig is (x, y, -z) of the scene, scaled."""

SCENE = """#version 3.7;
global_settings {{ assumed_gamma 1 }}
#declare H = {half_width_mm};
#declare Red = pigment {{ function {{ 0.5 + 0.25 * x / H }} color_map {{ [0.25 rgb z] [0.75 rgb <2, 0, 1>] }} }}
#declare Green = pigment {{ function {{ 0.5 + 0.25 * y / H }} color_map {{ [0.25 rgb z] [0.75 rgb <0, 2, 1>] }} }}
polygon {{ 5, <-H, -H>, <H, -H>, <H, H>, <-H, H>, <-H, -H>
  pigment {{ average pigment_map {{ [1 Red] [1 Green] }} }}
  finish {{ ambient 0 diffuse 0 emission 1 }}
  translate {distance_mm} * z
  scale 1 / {mm_per_unit}
}}
background {{ rgb 1 }}
#include "lippmann/ray_camera.inc"
#include "lippmann-rays.inc"
camera {{ Lippmann_Ray_Camera(Lippmann_Rays, {stage}, {mm_per_unit}) }}
#ifdef (Lippmann_Blind) object {{ Lippmann_Blind Lippmann_Stage({stage}, {mm_per_unit}) }} #end
"""


def shown(room: Room, rays: Rays, *, distance_mm: float = 1000.0, mm_per_unit: float = 1.0) -> NDArray[np.uint16]:
    """Return codes of what the rays see, (row, col, 3): a plane that tells positions, and white behind it."""
    rows, cols = rays.position.shape[:2]
    shutil.copytree(INCLUDE_FOLDER / "lippmann", room.task_dir / "lippmann", dirs_exist_ok=True)
    (room.task_dir / "lippmann-rays.inc").write_bytes(
        b"".join(ray_camera_text([rays], rows * cols, scaffold(rays, front_mm=0.0, mm_per_unit=mm_per_unit)))
    )
    (room.task_dir / "tile.pov").write_text(
        SCENE.format(half_width_mm=HALF_WIDTH_MM, distance_mm=distance_mm, mm_per_unit=mm_per_unit, stage=STAGE)
    )
    region = ray_camera_region(rows=rows, cols=cols)
    outcome = room.render(rows=region.row_stop, cols=cols, region=region, picture_format="ppm16", picture="tile.ppm")
    return read_codes(outcome.picture)[region.row_start :]


def error_mm(codes: NDArray[np.uint16], rays: Rays, *, distance_mm: float = 1000.0) -> NDArray[np.float64]:
    """Return how far the decoded points are from where the rays meet the plane."""
    found = codes[..., :2] / 65535 * 2 * HALF_WIDTH_MM - HALF_WIDTH_MM
    distance: NDArray[np.float64] = np.hypot(*np.moveaxis(found - rays.at_z(-distance_mm)[..., :2], -1, 0))
    return distance


def paper_rays(**more: Any) -> Rays:
    """Return the rays of a small sheet of 10 x 14 lenses, with rows unlike cols."""
    spec = small_job("target-position", count=(10, 14), **more)
    return pixel_rays(bench(spec.rig, reference_mm=1000.0), rows=80, cols=112)


@pytest.mark.parametrize("distance_mm", [300.0, 1500.0])
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_every_pixel_sees_along_its_ray(best: Room, projection: str, distance_mm: float) -> None:
    rays = paper_rays(camera={"projection": projection})
    error = error_mm(shown(best, rays, distance_mm=distance_mm), rays, distance_mm=distance_mm)
    assert np.median(error) <= MEDIAN_MM
    assert error.max() <= LARGEST_MM


@pytest.mark.parametrize("mm_per_unit", [0.01, 1000.0])
def test_the_scale_of_the_scene_makes_no_difference(best: Room, mm_per_unit: float) -> None:
    rays = paper_rays()
    rays.direction[20:30, :50] = np.nan
    codes = shown(best, rays, mm_per_unit=mm_per_unit)
    dead = np.isnan(rays.direction[..., 2])
    assert error_mm(codes, rays)[~dead].max() <= LARGEST_MM
    assert not codes[dead].any()


def test_dead_pixels_are_black_and_are_not_seen_by_others(best: Room) -> None:
    rays = paper_rays()
    noise = np.random.default_rng(1)
    dead = noise.random(rays.position.shape[:2]) < 0.3
    dead[0], dead[:, -1] = True, True
    rays.direction[dead] = np.nan
    codes = shown(best, rays)
    assert not codes[dead].any()
    assert (codes[~dead][:, 2] == 65535).all()
    assert error_mm(codes, rays)[~dead].max() <= LARGEST_MM


def test_a_picture_may_be_all_dead(best: Room) -> None:
    rays = paper_rays()
    rays.direction[:] = np.nan
    assert not shown(best, rays).any()


def test_a_region_has_the_rays_of_its_place_in_the_whole() -> None:
    optical_bench = bench(small_job("fish", count=(6, 6)).rig, reference_mm=1000.0)
    whole = pixel_rays(optical_bench, rows=96, cols=48)
    part = pixel_rays(optical_bench, rows=96, cols=48, region=(slice(16, 40), slice(8, 48)))
    assert np.array_equal(part.position, whole.position[16:40, 8:48])
    assert np.array_equal(part.direction, whole.direction[16:40, 8:48])


def light(folder: Path, spec: JobSpec) -> NDArray[np.float32]:
    """Return a frame rendered as a worker does."""
    place = local_place(folder)
    with rendered(place, stored_job(place, spec), tile=None) as picture:
        row_start, row_stop, col_start, col_stop = picture.wanted
        return read_rgb(picture.outcome.picture, np.float32)[row_start:row_stop, col_start:col_stop]


def test_it_agrees_with_modelled_glass_on_the_fish(tmp_path: Path) -> None:
    """Peak signal-to-noise ratio of the 8-bit sRGB codes that a viewer sees."""
    glass, rays = (
        srgb_codes(light(tmp_path / method, small_job("fish", count=(30, 30), capture={"method": method})))
        for method in ("glass", "ray_camera")
    )
    error = np.mean((glass.astype(float) - rays) ** 2)
    assert 10 * np.log10(255**2 / error) >= AGREEMENT_DB
