"""Exact images and spots: laws of stops and apertures, and the bundle that the array takes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lippmann.job.optics.rig import Rig
from lippmann.optics.lens.matrices import conjugate
from lippmann.optics.lens.surfaces import ImagingLens
from lippmann.optics.lens.trace import axis_crossing_mm
from lippmann.optics.rig.bench import Bench, bench
from lippmann.optics.rig.spots import best_focus, focus_at, spot, used_rays, working_f_number


def bench_of(**rig: Any) -> Bench:
    return bench(Rig.model_validate(rig), reference_mm=1000.0)


def lens_of(bench: Bench) -> ImagingLens:
    assert bench.imaging_lens is not None
    return bench.imaging_lens


@pytest.mark.parametrize("object_mm", [1000.0, 1750.0, 2500.0])
def test_stopped_down_the_exact_image_is_the_paraxial_one(object_mm: float) -> None:
    here = bench_of(stop_mm=2.0)
    found = best_focus(here, object_mm)
    assert found is not None
    assert found.image_mm == pytest.approx(conjugate(lens_of(here), object_mm).image_mm, abs=0.01)
    assert found.rms_mm < 1e-4


def test_the_exact_image_lies_between_the_paraxial_one_and_the_crossing_of_the_outermost_ray() -> None:
    here = bench_of(lens_array={"count": [100, 100]})
    used = used_rays(here, object_mm=1000.0, height_mm=0.0)
    found = best_focus(here, 1000.0)
    assert used is not None
    assert found is not None
    # The outermost used ray leaves with the slope of the corner of a square cell, by a height of about 43 mm x sqrt 2.
    outermost_mm = axis_crossing_mm(lens_of(here), object_mm=1000.0, height_mm=62.0)
    assert outermost_mm < found.image_mm < conjugate(lens_of(here), 1000.0).image_mm


def test_the_spot_is_smallest_at_best_focus() -> None:
    here = bench_of()
    used, found = used_rays(here, object_mm=1000.0, height_mm=0.0), best_focus(here, 1000.0)
    assert used is not None
    assert found is not None
    beside = [spot(used, here, image_mm=found.image_mm + step_mm).rms_mm for step_mm in (-0.5, -0.05, 0.05, 0.5)]
    assert min(beside) > found.rms_mm


def test_a_wider_cone_of_the_array_makes_a_larger_spot() -> None:
    slow, fast = (best_focus(bench_of(lens_array={"focal_length_mm": f_mm}), 1000.0) for f_mm in (6.6, 3.3))
    assert slow is not None
    assert fast is not None
    # Third-order spherical aberration: the spot grows with the cube of the cone.
    assert fast.rms_mm / slow.rms_mm == pytest.approx(8.0, rel=0.15)


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
@pytest.mark.parametrize("height_mm", [0.0, -120.0])
def test_used_rays_arrive_inside_the_array_and_inside_a_cell(lattice: str, height_mm: float) -> None:
    here = bench_of(lens_array={"lattice": lattice})
    used = used_rays(here, object_mm=1000.0, height_mm=height_mm)
    assert used is not None
    slope = np.abs(used.direction[:, :2] / used.direction[:, 2:])
    assert slope[:, 0].max() <= 1 / 6.6
    assert slope[:, 0].max() > 0.9 / 6.6
    corner = 1 / 6.6 if lattice == "square" else 1 / (3.3 * np.sqrt(3))
    assert slope[:, 1].max() <= corner
    assert np.abs(used.at_z(here.mla_z_mm)[:, :2]).max() <= 45.5


def test_a_point_at_the_edge_is_imaged_to_the_other_side_at_the_paraxial_height() -> None:
    here = bench_of(stop_mm=4.0)
    magnification = conjugate(lens_of(here), 1000.0).magnification
    image_mm = conjugate(lens_of(here), 1000.0).image_mm
    found = focus_at(here, 1000.0, height_mm=-2.0, image_mm=image_mm)
    assert found is not None
    assert found.height_mm == pytest.approx(-2.0 * magnification, rel=1e-3)


def test_where_no_light_arrives_there_is_no_image() -> None:
    assert focus_at(bench_of(), 1000.0, height_mm=-5000.0, image_mm=180.0) is None


@pytest.mark.parametrize("wanted", [4.0, 8.0, 22.0])
def test_for_a_distant_object_the_working_f_number_is_the_f_number(wanted: float) -> None:
    here = bench_of(f_number=wanted)
    assert working_f_number(here, 1e8) == pytest.approx(wanted, rel=2e-2)


def test_near_objects_are_imaged_by_a_more_pointed_cone() -> None:
    here = bench_of(f_number=8.0)
    found = [working_f_number(here, object_mm) or 0.0 for object_mm in (1e8, 2500.0, 1000.0)]
    assert found == sorted(found)


def test_direct_pickup_has_no_image_to_trace() -> None:
    here = bench_of(imaging_lens=None, lens_array={"offset_mm": -10.0})
    assert working_f_number(here, 1000.0) is None
    with pytest.raises(ValueError, match="direct pickup"):
        best_focus(here, 1000.0)
