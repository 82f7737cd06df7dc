"""One lens of the array."""

from __future__ import annotations

import numpy as np
import pytest

from lippmann.errors import OpticsError
from lippmann.job.optics.rig import Camera, LensArray, Rig
from lippmann.optics.rig.array import lens_centres_mm
from lippmann.optics.rig.bench import Bench, bench, camera_rays, pixel_centres_mm, through_array
from lippmann.optics.rig.microlens import microlens


def one_lens(*, px_per_lens: int = 8) -> Bench:
    return bench(Rig(lens_array=LensArray(count=(1, 1)), px_per_lens=px_per_lens), reference_mm=1000.0)


def test_radius_and_displacement_are_the_published_ones() -> None:
    full, inscribed = microlens(LensArray()), microlens(LensArray(aperture="inscribed"))
    assert full.radius_mm == pytest.approx(1.617, abs=1e-12)
    assert full.displacement_mm == pytest.approx(1.454197, abs=5e-7)
    assert inscribed.displacement_mm == pytest.approx(1.537755, abs=5e-7)


def test_a_pitch_wider_than_the_sphere_is_refused_by_name() -> None:
    with pytest.raises(OpticsError, match=r"rig\.lens_array\.pitch_mm: expected .* got 3 mm") as caught:
        microlens(LensArray(pitch_mm=3.0))
    assert caught.value.problems[0].field == "rig.lens_array.pitch_mm"


def test_an_axial_ray_leaves_toward_the_scene_with_slope_h_over_f() -> None:
    optical_bench = one_lens()
    height_mm = 1e-4
    rays = through_array(camera_rays(optical_bench, np.array([[0.0, height_mm]])), optical_bench)
    slope = -rays.direction[0, 1] / rays.direction[0, 2]
    assert slope == pytest.approx(-height_mm / 3.3, rel=1e-6)


def test_aberration_at_the_edge_of_a_lens_is_4_7_percent() -> None:
    optical_bench = one_lens()
    rays = through_array(camera_rays(optical_bench, np.array([[0.0, 0.5]])), optical_bench)
    slope = -rays.direction[0, 1] / rays.direction[0, 2]
    assert slope / (-0.5 / 3.3) == pytest.approx(1.047, abs=5e-4)


def test_rays_beside_inscribed_glass_go_straight() -> None:
    array = LensArray(count=(1, 1), aperture="inscribed")
    optical_bench = bench(Rig(lens_array=array), reference_mm=1000.0)
    corner = through_array(camera_rays(optical_bench, np.array([[0.49, 0.49]])), optical_bench)
    assert corner.direction[0] == pytest.approx([0.0, 0.0, -1.0])


def test_dead_corners_are_21_5_percent_of_an_inscribed_cell() -> None:
    array = LensArray(count=(1, 1), aperture="inscribed")
    optical_bench = bench(Rig(lens_array=array, px_per_lens=200), reference_mm=1000.0)
    rays = through_array(camera_rays(optical_bench, pixel_centres_mm(optical_bench)), optical_bench)
    straight = np.all(rays.direction == [0.0, 0.0, -1.0], axis=-1)
    assert straight.mean() == pytest.approx(1 - np.pi / 4, abs=2e-3)


def test_lens_centres_start_at_the_top_left_and_are_symmetric() -> None:
    centres = lens_centres_mm(LensArray(count=(3, 5), pitch_mm=2.0))
    assert centres.shape == (3, 5, 2)
    assert centres[0, 0] == pytest.approx([-4.0, 2.0])
    assert centres[::-1, ::-1] == pytest.approx(-centres)


def test_pixels_lie_evenly_under_their_lenses() -> None:
    optical_bench = bench(Rig(lens_array=LensArray(count=(3, 5)), px_per_lens=8), reference_mm=1000.0)
    cells = pixel_centres_mm(optical_bench).reshape(3, 8, 5, 8, 2)
    assert cells.mean(axis=(1, 3)) == pytest.approx(lens_centres_mm(optical_bench.rig.lens_array))


def test_a_perspective_camera_stands_where_its_angle_spans_the_array() -> None:
    rig = Rig(lens_array=LensArray(count=(90, 90)), camera=Camera(projection="perspective"))
    optical_bench = bench(rig, reference_mm=1000.0)
    half = np.arctan2(45.0, optical_bench.camera_z_mm - optical_bench.mla_z_mm)
    assert np.degrees(2 * half) == pytest.approx(6.738)
