"""Lens designs of Zemax."""

from __future__ import annotations

import pytest

from lippmann.errors import SpecError
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.prescription import lens_of
from lippmann.optics.lens.published import COOKE_TRIPLET
from lippmann.optics.lens.zemax_files import read_lens_zmx

HEAD = "VERS 120508 258 30813\nMODE SEQ\nNAME A SIMPLE TRIPLET\nUNIT MM X W X CM MR CPMM\nENPD 10\nWAVM 1 0.55 1\n"
OBJECT = "SURF 0\n  TYPE STANDARD\n  CURV 0.0\n  DISZ INFINITY\n  DIAM 0 0 0 0 1\n"
IMAGE = "  TYPE STANDARD\n  CURV 0.0\n  DISZ 0\n  DIAM 18.17 0 0 0 1\n"


def surface(number: int, *lines: str) -> str:
    return f"SURF {number}\n  TYPE STANDARD\n" + "".join(f"  {line}\n" for line in lines)


def triplet() -> str:
    blocks = [
        surface(1, "CURV 4.5426485E-2", "DISZ 3.258956", "GLAS SK16 0 0 1.5 40 0 0 0", "DIAM 9.5 1 0 0 1"),
        surface(2, "CURV -2.2948389E-3", "DISZ 6.007551", "DIAM 9.5 1 0 0 1"),
        surface(3, "CURV -4.5018122E-2", "DISZ 0.999975", "GLAS F2 0 0 1.5 40 0 0 0", "DIAM 5 1 0 0 1"),
        surface(4, "STOP", "CURV 4.9280698E-2", "DISZ 4.750409", "DIAM 5 1 0 0 1"),
        surface(5, "CURV 1.2549634E-2", "DISZ 2.952076", "GLAS ___BLANK 1 0 1.62041 60.32 0 0", "DIAM 7.5 1 0 0 1"),
        surface(6, "CURV -5.4361623E-2", "DISZ 42.20778", "DIAM 7.5 1 0 0 1"),
    ]
    return HEAD + OBJECT + "".join(blocks) + "SURF 7\n" + IMAGE


def test_the_triplet_of_a_file_is_the_preset() -> None:
    lens, preset = lens_of(read_lens_zmx(triplet())), COOKE_TRIPLET
    for found, expected in zip(lens.surfaces, preset.surfaces, strict=True):
        assert found.radius_mm == pytest.approx(expected.radius_mm, rel=1e-5)
        assert (found.thickness_mm, found.index_after) == (expected.thickness_mm, expected.index_after)
        assert (found.semi_aperture_mm, found.abbe_after) == (expected.semi_aperture_mm, expected.abbe_after)
    assert cardinal_points(lens).effective_focal_length_mm == pytest.approx(50.02, abs=0.01)
    assert lens.title == "A SIMPLE TRIPLET"


def test_a_stop_on_glass_stands_in_the_air_beside_its_rim() -> None:
    stop_z_mm = read_lens_zmx(triplet()).stop_z_mm
    assert stop_z_mm == pytest.approx(10.266482 + 0.62565, abs=1e-4)
    front = read_lens_zmx(triplet().replace("  STOP\n", "").replace("SURF 3\n", "SURF 3\n  STOP\n")).stop_z_mm
    assert front == pytest.approx(9.266507 - 0.57004, abs=1e-4)


def test_a_stop_of_its_own_is_no_surface() -> None:
    text = triplet().replace("  STOP\n", "").replace("DISZ 4.750409", "DISZ 2.0")
    text = text.replace("SURF 5\n", surface(9, "STOP", "CURV 0.0", "DISZ 2.750409") + "SURF 5\n")
    lens = read_lens_zmx(text)
    assert len(lens.surfaces) == 6
    assert lens.surfaces[3].thickness_mm == pytest.approx(4.750409)
    assert lens.stop_z_mm == pytest.approx(12.266482)


@pytest.mark.parametrize(("unit", "mm"), [("MM", 1.0), ("CM", 10.0), ("IN", 25.4)])
def test_units_scale_lengths_and_terms(unit: str, mm: float) -> None:
    asphere = triplet().replace("UNIT MM", f"UNIT {unit}")
    asphere = asphere.replace(
        "SURF 1\n  TYPE STANDARD", "SURF 1\n  TYPE EVENASPH\n  CONI -1.5\n  PARM 2 1E-6\n  PARM 1 0"
    )
    lens, in_mm = lens_of(read_lens_zmx(asphere)), lens_of(read_lens_zmx(asphere.replace(f"UNIT {unit}", "UNIT MM")))
    for found, expected in zip(lens.surfaces, in_mm.scaled(mm).surfaces, strict=True):
        assert found.radius_mm == pytest.approx(expected.radius_mm, rel=1e-12)
        assert found.aspheric == pytest.approx(expected.aspheric, rel=1e-12)
        assert found.sag_mm(mm) == pytest.approx(expected.sag_mm(mm), rel=1e-12)
    assert (lens.surfaces[0].conic, in_mm.surfaces[0].aspheric) == (-1.5, (1e-6,))


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        (
            "GLAS F2 0 0",
            "GLAS MIRROR 0 0",
            "line 27, GLAS: expected a surface that refracts: mirrors cannot be modelled",
        ),
        (
            "GLAS F2 0 0",
            "GLAS H-XYZ 0 0",
            "line 27, GLAS: expected a model glass (___BLANK 1 0 nd Vd), or one of N-FK5",
        ),
        ("SURF 3\n  TYPE STANDARD", "SURF 3\n  TYPE COORDBRK", "line 24, TYPE: expected one of STANDARD, EVENASPH"),
        ("SURF 3\n  TYPE STANDARD", "SURF 3\n  TYPE TOROIDAL", "other surfaces cannot be modelled, got TOROIDAL"),
        ("SURF 3\n  TYPE STANDARD", "SURF 3\n  TYPE EVENASPH\n  PARM 1 0.1", "line 25, PARM: expected terms of r^4"),
        ("DISZ 0.999975", "DISZ INFINITY", "line 26, DISZ: expected a finite distance, got INFINITY"),
        ("DISZ 0.999975", "DISZ -1", "line 23, SURF 3, thickness_mm: expected greater than or equal to 0, got -1.0"),
        ("DIAM 9.5 1 0 0 1", "DIAM 0 1 0 0 1", "line 17, DIAM: expected a semi-diameter above 0"),
        ("  DIAM 9.5 1 0 0 1\n", "", "line 12, SURF 1, DIAM: expected a semi-diameter above 0"),
        ("MODE SEQ", "MODE NSC", "line 2, MODE: expected SEQ: a sequential system, got NSC"),
        ("UNIT MM", "UNIT FURLONG", "line 4, UNIT: expected one of MM, CM, IN"),
        (
            "SURF 3\n  TYPE STANDARD",
            "SURF 3\n  TYPE EVENASPH\n  PARM nan 1",
            "line 25, PARM: expected a finite number",
        ),
        (
            "SURF 3\n  TYPE STANDARD",
            "SURF 3\n  TYPE EVENASPH\n  PARM inf 1",
            "line 25, PARM: expected a finite number",
        ),
        ("DISZ 0.999975", "DISZ nan", "line 26, DISZ: expected a finite number, got nan"),
        ("CURV 4.5426485E-2", "CURV 1e308", "line 12, SURF 1, radius_mm: expected a radius of at least 1e-06 mm, or"),
        ("CURV 4.5426485E-2", "CURV much", "line 14, CURV: expected a number, got much"),
    ],
)
def test_what_cannot_be_modelled_is_refused_with_its_line(old: str, new: str, problem: str) -> None:
    text = triplet()
    assert old in text
    with pytest.raises(SpecError) as caught:
        read_lens_zmx(text.replace(old, new))
    assert problem in caught.value.message


@pytest.mark.parametrize("text", ["", "hello", HEAD, HEAD + OBJECT])
def test_a_file_without_surfaces_is_refused(text: str) -> None:
    with pytest.raises(SpecError, match="SURF blocks"):
        read_lens_zmx(text)
