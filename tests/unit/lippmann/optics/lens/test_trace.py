"""The exact trace: laws of refraction, and frozen crossings of the paper's lens."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.optics.lens.matrices import conjugate
from lippmann.optics.lens.prescription import ATHINEOS_2006
from lippmann.optics.lens.trace import Rays, axis_crossing_mm, components, refract, stacked, through_lens, unit

# height on surface 1, mm -> where the ray from the axis 1000 mm away crosses it again, mm behind the last vertex.
CROSSINGS = {10.0: (183.947, 1e-3), 40.0: (177.995222516, 1e-9), 50.0: (174.384, 1e-3), 100.0: (142.839, 1e-3)}

directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 0.1).map(lambda v: unit(np.array(v)))


@pytest.mark.parametrize("height_mm", CROSSINGS)
def test_marginal_rays_cross_the_axis_where_frozen(height_mm: float) -> None:
    crossing_mm, tolerance_mm = CROSSINGS[height_mm]
    found = axis_crossing_mm(ATHINEOS_2006, object_mm=1000.0, height_mm=height_mm)
    assert found == pytest.approx(crossing_mm, abs=tolerance_mm)


def test_rays_near_the_axis_cross_it_at_the_paraxial_image() -> None:
    exact = axis_crossing_mm(ATHINEOS_2006, object_mm=1000.0, height_mm=1e-3)
    assert exact == pytest.approx(conjugate(ATHINEOS_2006, 1000.0).image_mm, rel=1e-8)


@given(directions, directions, st.floats(1.0, 2.0), st.floats(1.0, 2.0))
def test_refraction_obeys_snell_in_the_plane_of_incidence(
    direction: np.ndarray, normal: np.ndarray, before: float, after: float
) -> None:
    refracted = stacked(refract(components(direction), components(normal), index_before=before, index_after=after))
    sine = np.linalg.norm(np.cross(direction, normal))
    if before * sine > after * (1 - 1e-9):
        return
    assert np.linalg.norm(refracted) == pytest.approx(1.0, abs=1e-9)
    assert after * np.cross(refracted, normal) == pytest.approx(before * np.cross(direction, normal), abs=1e-7)
    assert (refracted @ normal) * (direction @ normal) >= 0  # A ray along the surface has no side.


def test_total_reflection_is_nan() -> None:
    steep = components(unit(np.array([1.0, 0.0, 0.1])))
    assert np.isnan(stacked(refract(steep, (0.0, 0.0, 1.0), index_before=1.5, index_after=1.0))).all()


@given(st.floats(-60, 60), st.floats(-60, 60), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1))
def test_light_goes_back_the_way_it_came(x: float, y: float, slope_x: float, slope_y: float) -> None:
    start = np.array([x, y, ATHINEOS_2006.length_mm + 150.0])
    there = through_lens(Rays(start, unit(np.array([slope_x, slope_y, -1.0]))), ATHINEOS_2006, backward=True)
    if np.isnan(there.direction).any():
        return
    back = through_lens(Rays(there.position - 10 * -there.direction, -there.direction), ATHINEOS_2006)
    assert back.at_z(float(start[2])) == pytest.approx(start, abs=1e-6)


def test_rays_outside_an_aperture_end_there() -> None:
    outside = Rays(np.array([0.0, 101.0, -10.0]), np.array([0.0, 0.0, 1.0]))
    assert np.isnan(through_lens(outside, ATHINEOS_2006).direction).all()
    assert not np.isnan(through_lens(outside, ATHINEOS_2006, stopped=False).direction).any()


def test_skew_rays_keep_their_skewness() -> None:
    """In a rotationally symmetric system n (x v_y - y v_x) is invariant."""
    start = Rays(np.array([20.0, -30.0, -1000.0]), unit(np.array([0.01, 0.02, 1.0])))
    end = through_lens(start, ATHINEOS_2006)

    def skewness(rays: Rays) -> float:
        (x, y, _), (v_x, v_y, _) = rays.position, rays.direction
        return float(x * v_y - y * v_x)

    assert skewness(end) == pytest.approx(skewness(start), rel=1e-12)
