"""The imaging lens of a rig: found, scaled, checked, stopped down."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from lippmann.errors import OpticsError, SpecError
from lippmann.job.optics.lens import Prescription
from lippmann.job.spec import parse_spec
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.prescription import CONTACT_GAP_MM, ImagingLens, lens_of, prescription_of, rig_lens
from lippmann.optics.lens.published import ATHINEOS_2006, IMAGING_LENSES, TRONNIER_1954
from lippmann.optics.lens.stop import f_number, stop_place_mm
from lippmann.optics.lens.trace import Rays, through_lens

BICONVEX: list[dict[str, Any]] = [
    {"radius_mm": 60.0, "thickness_mm": 8.0, "material": "BK7", "semi_aperture_mm": 15.0},
    {"radius_mm": -60.0, "index": 1.0, "semi_aperture_mm": 15.0},
]


def found(imaging_lens: Any, **rig: Any) -> ImagingLens:
    spec = parse_spec({"scene": "fish", "rig": {"imaging_lens": imaging_lens, **rig}})
    lens = rig_lens(spec.rig)
    assert lens is not None
    return lens


def changed(place: int, **fields: Any) -> dict[str, Any]:
    rows = [dict(row) for row in BICONVEX]
    rows[place] |= fields
    return {"surfaces": rows}


def test_a_rig_without_imaging_lens_has_none() -> None:
    spec = parse_spec({"scene": "fish", "rig": {"imaging_lens": None, "lens_array": {"offset_mm": -10}}})
    assert rig_lens(spec.rig) is None


def test_surfaces_in_contact_are_built_apart() -> None:
    assert found("athineos-2006") == ATHINEOS_2006.built()
    assert CONTACT_GAP_MM in [surface.thickness_mm for surface in found("athineos-2006").surfaces]


@pytest.mark.parametrize("name", IMAGING_LENSES)
def test_a_named_lens_can_be_made_to_any_focal_length(name: str) -> None:
    lens = found({"name": name, "focal_length_mm": 300.0})
    assert cardinal_points(lens).effective_focal_length_mm == pytest.approx(300.0, rel=1e-5)
    assert f_number(lens) == pytest.approx(f_number(IMAGING_LENSES[name]), rel=1e-5)


@pytest.mark.parametrize("name", IMAGING_LENSES)
def test_a_prescription_of_a_lens_is_that_lens(name: str) -> None:
    lens = IMAGING_LENSES[name]
    prescription = prescription_of(lens)
    assert Prescription.model_validate(prescription.model_dump(mode="json")) == prescription
    again = lens_of(prescription)
    assert (again.surfaces, again.stop_z_mm) == (lens.surfaces, lens.stop_z_mm)


@pytest.mark.parametrize("name", IMAGING_LENSES)
@pytest.mark.parametrize("number", [4.0, 8.0])
def test_the_stop_lets_the_f_number_through_that_was_asked_for(name: str, number: float) -> None:
    lens = found(name, f_number=number)
    assert f_number(lens) == pytest.approx(number, rel=1e-4)
    height_mm = cardinal_points(lens).effective_focal_length_mm / (2 * number)
    heights = height_mm * np.array([0.97, 1.03])
    start = np.stack([np.zeros(2), heights, np.full(2, -20.0)], axis=-1)
    after = through_lens(Rays(start, np.broadcast_to([0.0, 0.0, 1.0], start.shape)), lens)
    assert np.isnan(after.direction).any(axis=-1).tolist() == [False, True]


def test_a_stop_by_its_diameter_has_that_diameter() -> None:
    lens = found("double-gauss-tronnier", stop_mm=10.0)
    assert lens.stop is not None
    assert (lens.stop.semi_aperture_mm, lens.stop.z_mm) == (5.0, TRONNIER_1954.stop_z_mm)


def test_a_stop_nobody_placed_stands_in_the_widest_air_space_or_before_the_lens() -> None:
    assert stop_place_mm(ATHINEOS_2006) == pytest.approx(84.28 + 289.30 / 2)
    assert stop_place_mm(lens_of(Prescription.model_validate({"surfaces": BICONVEX}))) == 0.0


def test_a_stop_moves_with_the_gaps_before_it() -> None:
    rows = [*BICONVEX, {**BICONVEX[0], "thickness_mm": 8.0}, BICONVEX[1]]
    rows[1] = {**rows[1], "thickness_mm": 0.0}
    lens = found({"surfaces": rows, "stop_z_mm": 16.5}, stop_mm=10.0)
    assert lens.stop is not None
    assert lens.stop.z_mm == pytest.approx(16.5 + CONTACT_GAP_MM)


PLANE = {"radius_mm": None, "semi_aperture_mm": 15.0}


def convex(radius_mm: float) -> dict[str, Any]:
    return {"radius_mm": radius_mm, "semi_aperture_mm": 15.0}


GLASS, AIR = {"thickness_mm": 8.0, "material": "BK7"}, {"index": 1.0}


@pytest.mark.parametrize(
    ("surfaces", "asked_mm", "stands_mm"),
    [
        ([PLANE | GLASS, convex(-60) | AIR], None, -CONTACT_GAP_MM),
        ([PLANE | GLASS, convex(-60) | AIR], -1e-4, -CONTACT_GAP_MM),
        ([PLANE | GLASS, convex(-60) | AIR], -1.0, -1.0),
        ([convex(1e5) | GLASS, convex(-60) | AIR], 0.0, -CONTACT_GAP_MM),
        ([convex(60) | GLASS, PLANE | AIR], 0.0, -CONTACT_GAP_MM),
        ([convex(60) | GLASS, PLANE | AIR], 8.0, 8.0 + CONTACT_GAP_MM),
        ([convex(60) | GLASS, PLANE | AIR, PLANE | GLASS, convex(-60) | AIR], 8.0, 8.0 + CONTACT_GAP_MM / 2),
    ],
)
def test_a_stop_is_built_clear_of_the_glass_beside_it(
    surfaces: list[dict[str, Any]], asked_mm: float | None, stands_mm: float
) -> None:
    lens = found({"surfaces": surfaces, "stop_z_mm": asked_mm}, stop_mm=10.0)
    assert lens.stop is not None
    assert lens.stop.z_mm == pytest.approx(stands_mm, abs=1e-9)
    assert lens.surfaces_before_stop == sum(z_mm < stands_mm for z_mm in lens.vertices_mm)


@pytest.mark.parametrize(
    ("imaging_lens", "rig", "problem"),
    [
        ("nikon", {}, "rig.imaging_lens: expected one of athineos-2006, cooke-triplet"),
        ({"name": "nikon", "focal_length_mm": 5}, {}, "rig.imaging_lens.name: expected one of athineos-2006"),
        (changed(0, semi_aperture_mm=61.0), {}, "surfaces.0.semi_aperture_mm: expected at most 60 mm, where"),
        (
            changed(0, thickness_mm=3.0),
            {},
            "surfaces.0.thickness_mm: expected at least 3.81 mm, or rims within 13.12 mm, where this surf",
        ),
        (
            {"surfaces": [{**row, "radius_mm": None} for row in BICONVEX]},
            {},
            "rig.imaging_lens: expected a lens that bends light",
        ),
        (
            {"surfaces": [*BICONVEX[:1], {**BICONVEX[0], "thickness_mm": 0.0, "index": 1.7}, BICONVEX[1]]},
            {},
            "rig.imaging_lens.surfaces.1.thickness_mm: expected glass above 0 mm, got 0 mm",
        ),
        (
            {"surfaces": BICONVEX, "stop_z_mm": 4.0},
            {},
            "rig.imaging_lens.stop_z_mm: expected a stop in the air, not in",
        ),
        ({"surfaces": BICONVEX, "stop_z_mm": 8.0}, {"stop_mm": 20}, ""),
        (
            {"surfaces": BICONVEX, "stop_z_mm": 7.9},
            {"stop_mm": 20},
            "rig.imaging_lens.stop_z_mm: expected a stop in the",
        ),
        (
            "athineos-2006",
            {"stop_mm": 201},
            "rig.stop_mm: expected a stop at most as wide as the glass there, 200 mm, got",
        ),
        ("athineos-2006", {"f_number": 1.2}, "rig.f_number: expected at least 1.502, the full aperture, got 1.2"),
    ],
)
def test_a_lens_that_cannot_be_is_named(imaging_lens: Any, rig: dict[str, Any], problem: str) -> None:
    if not problem:
        assert found(imaging_lens, **rig).stop is not None
        return
    with pytest.raises(SpecError) as caught:
        found(imaging_lens, **rig)
    assert problem in caught.value.message


def test_total_reflection_of_the_marginal_ray_names_the_surface() -> None:
    rows = [
        {"radius_mm": None, "thickness_mm": 40.0, "index": 1.9, "semi_aperture_mm": 30.0},
        {"radius_mm": -35.0, "index": 1.0, "semi_aperture_mm": 30.0},
    ]
    with pytest.raises(OpticsError, match=r"surfaces\.1: expected a surface that the ray at the rim") as caught:
        found({"surfaces": rows})
    assert "totally reflected" in caught.value.message


@pytest.mark.parametrize(
    ("fields", "problem"),
    [
        (
            {"index": 0.9, "material": None},
            "rig.imaging_lens.surfaces.0.index: expected a number of at least 1, got 0.9",
        ),
        ({"material": "XYZ"}, "rig.imaging_lens.surfaces.0.material: expected a glass of Schott"),
        ({"material": "XYZ", "index": None}, "or an index of refraction beside it, got 'XYZ'"),
        ({"material": None}, "rig.imaging_lens.surfaces.0.index: expected an index of refraction, or a material"),
        ({"radius_mm": 1e-200}, "rig.imaging_lens.surfaces.0.radius_mm: expected a radius of at least 1e-06 mm"),
        (
            {"radius_mm": 0},
            "rig.imaging_lens.surfaces.0.radius_mm: expected a radius other than 0, or null for a plane",
        ),
        ({"thickness_mm": -1}, "rig.imaging_lens.surfaces.0.thickness_mm: expected a number of at least 0, got -1"),
    ],
)
def test_a_surface_that_cannot_be_is_named(fields: dict[str, Any], problem: str) -> None:
    with pytest.raises(SpecError) as caught:
        found(changed(0, **fields))
    assert problem in caught.value.message
    assert len(caught.value.problems) == 1


@pytest.mark.parametrize("count", [0, 1])
def test_a_lens_of_too_few_surfaces_is_named(count: int) -> None:
    problem = rf"rig\.imaging_lens\.surfaces: expected at least 2 surfaces, got {count}$"
    with pytest.raises(SpecError, match=problem):
        found({"surfaces": [BICONVEX[0]] * count})


def test_a_focal_length_that_no_number_can_hold_is_named() -> None:
    problem = r"rig\.imaging_lens\.focal_length_mm: expected a number of at least 0\.000001, got 1e-300"
    with pytest.raises(SpecError, match=problem):
        found({"name": "cooke-triplet", "focal_length_mm": 1e-300})


def test_the_last_medium_is_air() -> None:
    with pytest.raises(SpecError, match=r"air \(index 1\) behind the last surface, got index 1\.5"):
        found(changed(1, index=1.5))


def test_every_preset_is_within_its_own_checks() -> None:
    for lens in IMAGING_LENSES.values():
        assert not math.isnan(f_number(found(lens.name)))
