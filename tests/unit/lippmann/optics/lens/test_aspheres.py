"""Aspheres: laws, perfect foci, and the sphere as a special case."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.optics.lens.asphere import Profile, meet_profile
from lippmann.optics.lens.surfaces import ImagingLens, Stop, Surface
from lippmann.optics.lens.trace import Rays, meet_sphere, stacked, through_lens, unit

INDEX = 1.5
FOCAL_MM = 100.0


def plano(back: Surface) -> ImagingLens:
    return ImagingLens("", "", "", (Surface(math.inf, 10.0, INDEX, 60.0), back))


def fan(heights_mm: np.ndarray, *, slope: float = 0.0) -> Rays:
    start = np.stack([0.3 * heights_mm, heights_mm, np.full_like(heights_mm, -5.0)], axis=-1)
    return Rays(start, np.broadcast_to(unit(np.array([0.0, slope, 1.0])), start.shape))


def test_a_plano_hyperbolic_lens_focuses_parallel_light_to_a_point() -> None:
    """Inside the glass parallel, behind a hyperboloid of conic -n^2: all optical paths are equal (Descartes 1637)."""
    lens = plano(Surface(-(INDEX - 1) * FOCAL_MM, 0.0, 1.0, 50.0, conic=-(INDEX**2)))
    at_focus = through_lens(fan(np.linspace(-45, 45, 19)), lens).at_z(lens.length_mm + FOCAL_MM)
    assert np.abs(at_focus[:, :2]).max() < 1e-9


def test_a_sphere_of_the_same_radius_does_not() -> None:
    lens = plano(Surface(-(INDEX - 1) * FOCAL_MM, 0.0, 1.0, 50.0))
    at_focus = through_lens(fan(np.linspace(-25, 25, 19)), lens).at_z(lens.length_mm + FOCAL_MM)
    assert np.abs(at_focus[:, :2]).max() > 1.0


def test_an_ellipsoid_focuses_parallel_light_inside_the_glass() -> None:
    """Conic -1 / n^2: the far focus of the ellipsoid."""
    radius_mm = 40.0
    surface = Surface(radius_mm, 0.0, INDEX, 30.0, conic=-1 / INDEX**2)
    one = ImagingLens("", "", "", (surface,))
    at_focus = through_lens(fan(np.linspace(-28, 28, 15)), one).at_z(radius_mm * INDEX / (INDEX - 1))
    assert np.abs(at_focus[:, :2]).max() < 1e-9


def test_the_sag_of_a_paraboloid_has_a_closed_form() -> None:
    square = np.linspace(0, 50, 11) ** 2
    found = Profile(1 / 80, conic=-1.0, aspheric=(1e-6, -2e-10)).sag_mm(square)
    assert found == pytest.approx(square / 160 + 1e-6 * square**2 - 2e-10 * square**3, rel=1e-14)


@given(
    st.sampled_from([30.0, -30.0, 500.0, -500.0]), *[st.floats(-15, 15)] * 2, *[st.floats(-0.4, 0.4)] * 2, st.booleans()
)
def test_the_search_meets_a_sphere_where_the_formula_does(
    radius_mm: float, x: float, y: float, slope_x: float, slope_y: float, backward: bool
) -> None:
    direction = unit(np.array([slope_x, slope_y, -1.0 if backward else 1.0]))
    rays = Rays(np.array([x, y, 0.0]) - 5 * direction, direction)
    expected, normals = map(stacked, meet_sphere(rays.parts, vertex_z_mm=1.0, radius_mm=radius_mm))
    found, found_normals = map(stacked, meet_profile(rays.parts, Profile(1 / radius_mm), vertex_z_mm=1.0))
    # A steep ray may miss the sphere; both are then NaN.
    assert found == pytest.approx(expected, abs=1e-8, nan_ok=True)
    assert found_normals == pytest.approx(normals * np.sign(normals[2]), abs=1e-9, nan_ok=True)


@given(*[st.floats(-20, 20)] * 2, *[st.floats(-0.2, 0.2)] * 2)
def test_the_crossing_lies_on_ray_and_surface_and_the_normal_is_square_to_it(
    x: float, y: float, slope_x: float, slope_y: float
) -> None:
    profile = Profile(-1 / 60, conic=0.7, aspheric=(2e-6, -3e-10))
    direction = unit(np.array([slope_x, slope_y, 1.0]))
    rays = Rays(np.array([x, y, -30.0]), direction)
    point, normal = map(stacked, meet_profile(rays.parts, profile, vertex_z_mm=3.0))
    height_mm = math.hypot(point[0], point[1])
    assert point[2] == pytest.approx(3.0 + float(profile.sag_mm(np.array(height_mm**2))), abs=1e-9)
    assert np.cross(point - np.array([x, y, -30.0]), direction) == pytest.approx(np.zeros(3), abs=1e-9)
    step = 1e-4
    for across in (np.array([step, 0.0]), np.array([0.0, step])):
        heights = [np.sum((point[:2] + side * across) ** 2) for side in (-1, 1)]
        rise = np.diff(profile.sag_mm(np.array(heights)))[0]
        assert np.dot(normal, [*(2 * across), rise]) == pytest.approx(0.0, abs=1e-9)


def test_rays_beside_an_ellipsoid_miss_it() -> None:
    position = np.array([[0.0, 0.0, -5.0], [0.0, 45.0, -5.0]])
    rays = Rays(position, np.broadcast_to([0.0, 0.0, 1.0], position.shape))
    points, _ = meet_profile(rays.parts, Profile(1 / 40, conic=0.1), vertex_z_mm=0.0)
    assert np.isnan(stacked(points)).any(axis=-1).tolist() == [False, True]


@given(st.floats(-30, 30), st.floats(-30, 30), st.floats(-0.1, 0.1))
def test_light_goes_back_the_way_it_came_through_an_asphere_and_a_stop(x: float, y: float, slope: float) -> None:
    lens = plano(Surface(-80.0, 0.0, 1.0, 60.0, conic=-2.0, aspheric=(1e-7, 1e-11)))
    lens = ImagingLens("", "", "", lens.surfaces, stop=Stop(-2.0, 40.0))
    start = Rays(np.array([x, y, -5.0]), unit(np.array([slope, 0.0, 1.0])))
    there = through_lens(start, lens)
    if np.isnan(there.direction).any():
        return
    back = through_lens(Rays(there.position + 9 * there.direction, -there.direction), lens, backward=True)
    assert back.at_z(-5.0) == pytest.approx(start.position, abs=1e-7)


@pytest.mark.parametrize("factor", [0.1, 7.0])
def test_a_scaled_asphere_bends_light_alike(factor: float) -> None:
    lens = plano(Surface(-80.0, 0.0, 1.0, 60.0, conic=-2.0, aspheric=(1e-7, 1e-11)))
    rays = fan(np.linspace(-30, 30, 7), slope=0.05)
    found = through_lens(Rays(rays.position * factor, rays.direction), lens.scaled(factor))
    expected = through_lens(rays, lens)
    assert found.direction == pytest.approx(expected.direction, abs=1e-12)
    assert found.position == pytest.approx(expected.position * factor, abs=1e-9)
