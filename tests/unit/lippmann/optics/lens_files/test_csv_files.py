"""Lens designs as CSV."""

from __future__ import annotations

import pytest

from lippmann.errors import SpecError
from lippmann.job.optics.lens import Prescription
from lippmann.optics.lens.prescription import lens_of
from lippmann.optics.lens.published import TRONNIER_1954
from lippmann.optics.lens_files.csv_files import read_lens_csv
from lippmann.optics.lens_files.glasses.agf import read_agf
from lippmann.optics.lens_files.glasses.search import GlassSearch

TRONNIER = """\
# US patent 2,673,491
radius;thickness;material;index;v-no;sa
29.475;3.76;;1.67125;47.1;12.6
84.83;0.12;;;;12.6
19.275;4.025;;1.67125;47.1;11.5
40.77;3.275;;1.69842;30.1;11.5
12.75;5.705;air;;;9
inf;4.5;STOP;;;8.55
-14.495;1.18;;1.60266;38.4;8.5
40.77;6.065;;1.65953;57.0;10
-20.385;0.19;;1;;10
437.065;3.22;;1.7174;48.1;10
-39.73;;;;;10
"""


def prescription(text: str) -> Prescription:
    return read_lens_csv(text).prescription


def test_a_published_table_is_the_preset() -> None:
    lens = lens_of(prescription(TRONNIER))
    assert lens.surfaces == TRONNIER_1954.surfaces
    assert lens.stop_z_mm == pytest.approx(16.885)


def test_the_header_may_be_left_out_and_may_set_the_order() -> None:
    assert prescription("\n".join(TRONNIER.splitlines()[2:])) == prescription(TRONNIER)
    turned = prescription("sa;radius;thickness;material;index;v-no\n10;50;5;BK7;;\n10;-50;;;;")
    assert turned == prescription("50;5;BK7;;;10\n-50;;;;;10")


@pytest.mark.parametrize("plane", ["", "0", "inf", "Infinity", "-inf", "1e18"])
def test_a_plane_is_written_in_many_ways(plane: str) -> None:
    lens = prescription(f"{plane};5;BK7;;;10\n-50;0;;;;10")
    assert lens.surfaces[0].radius_mm is None


def test_an_unnamed_plane_in_air_is_the_stop_too() -> None:
    assert prescription(TRONNIER.replace("STOP", "")) == prescription(TRONNIER)


@pytest.mark.parametrize("head", ["", "inf;1000;;;;10\n", ";inf;;;;\n"])
@pytest.mark.parametrize("tail", ["", "\n;0;;;;10", "\n;5;;;;\n;0;;;;10"])
def test_object_and_image_are_no_stops(head: str, tail: str) -> None:
    lens = prescription(f"{head}50;5;BK7;;;10\n-50;95;;;;10{tail}")
    assert lens == prescription("50;5;BK7;;;10\n-50;;;;;10")
    assert lens.stop_z_mm is None


def test_a_named_stop_beside_object_and_image_is_the_stop() -> None:
    lens = prescription("inf;inf;;;;\n;3;STOP;;;5\n50;5;BK7;;;10\n-50;95;;;;10\n;0;;;;10")
    assert (lens.stop_z_mm, len(lens.surfaces)) == (-3.0, 2)


def test_a_stop_before_the_lens_has_a_negative_place() -> None:
    lens = prescription(";3;STOP;;;5\n50;5;BK7;;;10\n-50;;;;;10")
    assert (lens.stop_z_mm, len(lens.surfaces)) == (-3.0, 2)


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("50,5;5;BK7;;;10", "line 1, radius: expected a number with a decimal point, got '50,5' with a comma"),
        ("50;5;BK7;;;", "line 1, semi_aperture_mm: expected a value, got nothing"),
        (
            "50;5;XYZ1;;;10",
            "line 1, material: expected a glass of Schott, Ohara, Hoya, CDGM, Hikari, Sumita by its",
        ),
        ("50;-5;BK7;;;10", "line 1, thickness_mm: expected a number of at least 0, got -5.0"),
        ("50;5;BK7;0.9;;10", "line 1, index: expected a number of at least 1, got 0.9"),
        ("50;5;BK7;10", "line 1: expected 6 cells, radius;thickness;material;index;v-no;sa, got 4 (50;5;BK7;10)"),
        ("50;nan;BK7;;;10", "line 1, thickness: expected a finite number, got 'nan'"),
        ("50;inf;BK7;;;10", "line 1, thickness: expected a finite number, got 'inf'"),
        ("abc;5;BK7;;;10", "line 1, radius: expected a number, got 'abc'"),
        ("50;5;STOP;;;10", "line 1, material: expected a stop as a plane with air on both sides, got a stop elsewhere"),
        ("radius;thick;material;index;v-no;sa", "line 1: expected the columns radius;thickness;material;index;v-no;sa"),
    ],
)
def test_what_is_wrong_is_named(line: str, problem: str) -> None:
    with pytest.raises(SpecError) as caught:
        prescription(f"{line}\n-50;;;;;10")
    assert problem in caught.value.message


def test_two_stops_are_refused() -> None:
    text = ";1;STOP;;;5\n50;5;BK7;;;10\n-50;2;;;;10\n;1;STOP;;;5"
    with pytest.raises(SpecError, match="line 4: expected one stop; line 1 has it"):
        prescription(text)


@pytest.mark.parametrize("text", ["", "# nothing", ";5;;;;10", "50;5;BK7;;;10"])
def test_too_little_is_refused(text: str) -> None:
    with pytest.raises(SpecError):
        prescription(text)


def test_a_glass_of_a_catalogue_has_its_index() -> None:
    search = GlassSearch([read_agf("NM MINE 5 0 1.5 50\nCD 1.5 0.01 0.0", title="own.agf")])
    file = read_lens_csv("50;5;mine;;;10\n-50;;;;;10", search)
    assert file.prescription.surfaces[0].index == pytest.approx(1.5 + 0.01 / 0.5875618)
    assert file.places == ("line 1", "line 2")
