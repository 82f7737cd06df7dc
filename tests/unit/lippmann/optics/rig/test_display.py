"""The display side: laws of gaps and planes, then the paper's numbers."""

from __future__ import annotations

import math

import pytest

from lippmann.optics.rig.display import (
    central_depth_plane_mm,
    chosen_gap_mm,
    gap_of_plane_mm,
    physical_gap_mm,
    reduced_gap_mm,
    resolvable_depth_mm,
    viewing_angle_deg,
    viewing_zone_mm,
)

ITEM_630 = {"substrate_mm": 3.3, "index": 1.49}
DPI_600_MM, DPI_203_MM = 25.4 / 600, 25.4 / 203


@pytest.mark.parametrize("physical_mm", [0.5, 3.3, 3.3000001, 4.385, 4.8, 40.0])
def test_reduced_and_physical_gaps_are_inverses(physical_mm: float) -> None:
    reduced_mm = reduced_gap_mm(physical_mm, **ITEM_630)
    assert physical_gap_mm(reduced_mm, **ITEM_630) == pytest.approx(physical_mm, rel=1e-14)


def test_without_substrate_both_gaps_are_the_same() -> None:
    assert reduced_gap_mm(4.8, substrate_mm=0.0, index=1.49) == 4.8


@pytest.mark.parametrize("gap_mm", [0.1, 2.2, 3.2, 3.4, 6.6, 100.0])
def test_a_gap_and_its_plane_are_inverses_and_obey_the_lens_equation(gap_mm: float) -> None:
    plane_mm = central_depth_plane_mm(focal_length_mm=3.3, gap_mm=gap_mm)
    assert gap_of_plane_mm(focal_length_mm=3.3, plane_mm=plane_mm) == pytest.approx(gap_mm, rel=1e-13)
    assert 1 / gap_mm + 1 / plane_mm == pytest.approx(1 / 3.3, rel=1e-13)


def test_pixels_in_the_focal_plane_are_imaged_to_infinity_and_back() -> None:
    assert central_depth_plane_mm(focal_length_mm=3.3, gap_mm=3.3) == math.inf
    assert gap_of_plane_mm(focal_length_mm=3.3, plane_mm=math.inf) == 3.3


@pytest.mark.parametrize("plane_mm", [0.0, 1.0, 3.3])
def test_no_gap_puts_the_plane_nearer_before_the_lenses_than_a_focal_length(plane_mm: float) -> None:
    with pytest.raises(ValueError, match=r"over 3\.3 mm before"):
        gap_of_plane_mm(focal_length_mm=3.3, plane_mm=plane_mm)


@pytest.mark.parametrize(("shallow_mm", "deep_mm"), [(0.0, 40.0), (10.0, 60.0), (-5.0, -50.0), (0.0, -9.0)])
def test_the_chosen_gap_puts_the_plane_into_the_middle_of_the_depths(shallow_mm: float, deep_mm: float) -> None:
    gap_mm = chosen_gap_mm(shallow_mm, deep_mm, focal_length_mm=3.3, contact_mm=0.0)
    plane_mm = central_depth_plane_mm(focal_length_mm=3.3, gap_mm=gap_mm)
    assert plane_mm == pytest.approx((shallow_mm + deep_mm) / 2, rel=1e-12)


def test_the_chosen_gap_is_collimated_for_no_depth_life_size_for_little_and_never_inside_the_substrate() -> None:
    choose = {"focal_length_mm": 3.3, "contact_mm": 3.3 / 1.49}
    assert chosen_gap_mm(0.0, 0.0, **choose) == 3.3
    assert chosen_gap_mm(0.0, 1.0, **choose) == pytest.approx(6.6)
    assert chosen_gap_mm(0.0, -2.0, **choose) == pytest.approx(3.3 / 1.49)


@pytest.mark.parametrize(
    ("physical_mm", "reduced_mm", "plane_mm", "angle_deg"),
    [(4.8, 3.71477, 29.556, 15.33), (3.3, 2.21477, -6.735, 25.44)],
)
def test_the_paper_s_gaps(physical_mm: float, reduced_mm: float, plane_mm: float, angle_deg: float) -> None:
    gap_mm = reduced_gap_mm(physical_mm, **ITEM_630)
    assert gap_mm == pytest.approx(reduced_mm, abs=5.1e-6)
    assert central_depth_plane_mm(focal_length_mm=3.3, gap_mm=gap_mm) == pytest.approx(plane_mm, abs=5.1e-4)
    assert viewing_angle_deg(pitch_mm=1.0, gap_mm=gap_mm) == pytest.approx(angle_deg, abs=5.1e-3)


def test_the_collimated_gap_of_the_paper_s_array_and_its_angle() -> None:
    assert physical_gap_mm(3.3, **ITEM_630) == pytest.approx(4.385, abs=5e-4)
    assert viewing_angle_deg(pitch_mm=1.0, gap_mm=3.3) == pytest.approx(17.2, abs=0.05)


@pytest.mark.parametrize("gap_mm", [2.2, 3.3, 3.7])
def test_the_viewing_zone_spans_the_viewing_angle(gap_mm: float) -> None:
    half = math.radians(viewing_angle_deg(pitch_mm=1.0, gap_mm=gap_mm) / 2)
    zone_mm = viewing_zone_mm(pitch_mm=1.0, gap_mm=gap_mm, distance_mm=1000.0)
    assert zone_mm == pytest.approx(2 * 1000.0 * math.tan(half), rel=1e-12)
    assert viewing_zone_mm(pitch_mm=1.0, gap_mm=gap_mm, distance_mm=1000.0, apart_mm=99.0) == zone_mm - 99.0
    assert viewing_zone_mm(pitch_mm=1.0, gap_mm=gap_mm, distance_mm=10.0, apart_mm=99.0) == 0.0


@pytest.mark.parametrize(("pixel_mm", "front_mm", "back_mm"), [(DPI_600_MM, 72.0, 85.0), (DPI_203_MM, 26.0, 27.0)])
def test_a_print_and_a_panel_resolve_what_is_published_at_one_metre(
    pixel_mm: float, front_mm: float, back_mm: float
) -> None:
    found = resolvable_depth_mm(pitch_mm=1.0, gap_mm=3.3, pixel_mm=pixel_mm, distance_mm=1000.0)
    assert (found.front_mm, found.back_mm) == pytest.approx((front_mm, back_mm), abs=0.5)


@pytest.mark.parametrize("pixel_mm", [0.01, 0.04, 0.125])
@pytest.mark.parametrize("gap_mm", [2.2, 3.3])
def test_at_the_limits_the_finest_detail_is_as_wide_as_the_lenses_seen_there(pixel_mm: float, gap_mm: float) -> None:
    found = resolvable_depth_mm(pitch_mm=1.0, gap_mm=gap_mm, pixel_mm=pixel_mm, distance_mm=1000.0)
    for depth_mm in (found.front_mm, -found.back_mm):
        projected_mm = abs(depth_mm) * pixel_mm / gap_mm
        seen_mm = 1.0 * (1000.0 - depth_mm) / 1000.0
        assert projected_mm == pytest.approx(seen_mm, rel=1e-12)


def test_there_is_no_limit_behind_when_the_eye_resolves_less_than_the_pixels_do() -> None:
    assert resolvable_depth_mm(pitch_mm=1.0, gap_mm=3.3, pixel_mm=0.001, distance_mm=1000.0).back_mm == math.inf
