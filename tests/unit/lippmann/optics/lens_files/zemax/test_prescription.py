"""Lens designs of Zemax."""

from __future__ import annotations

import pytest

from lippmann.errors import SpecError
from lippmann.job.optics.lens import Prescription
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.prescription import lens_of
from lippmann.optics.lens.published import COOKE_TRIPLET
from lippmann.optics.lens_files.glasses.agf import read_agf
from lippmann.optics.lens_files.glasses.search import GlassSearch
from lippmann.optics.lens_files.zemax.prescription import read_lens_zmx

HEAD = "VERS 120508 258 30813\nMODE SEQ\nNAME A SIMPLE TRIPLET\nUNIT MM X W X CM MR CPMM\nENPD 10\nWAVM 1 0.55 1\n"
OBJECT = "SURF 0\n  TYPE STANDARD\n  CURV 0.0\n  DISZ INFINITY\n  DIAM 0 0 0 0 1\n"
IMAGE = "  TYPE STANDARD\n  CURV 0.0\n  DISZ 0\n  DIAM 18.17 0 0 0 1\n"


def prescription(text: str) -> Prescription:
    return read_lens_zmx(text).prescription


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
    lens, preset = lens_of(prescription(triplet())), COOKE_TRIPLET
    for found, expected in zip(lens.surfaces, preset.surfaces, strict=True):
        assert found.radius_mm == pytest.approx(expected.radius_mm, rel=1e-5)
        assert (found.thickness_mm, found.index_after) == (expected.thickness_mm, expected.index_after)
        assert (found.semi_aperture_mm, found.abbe_after) == (expected.semi_aperture_mm, expected.abbe_after)
    assert cardinal_points(lens).effective_focal_length_mm == pytest.approx(50.02, abs=0.01)
    assert lens.title == "A SIMPLE TRIPLET"


def test_a_stop_on_glass_stands_in_the_air_beside_its_rim() -> None:
    stop_z_mm = prescription(triplet()).stop_z_mm
    assert stop_z_mm == pytest.approx(10.266482 + 0.62565, abs=1e-4)
    front = prescription(triplet().replace("  STOP\n", "").replace("SURF 3\n", "SURF 3\n  STOP\n")).stop_z_mm
    assert front == pytest.approx(9.266507 - 0.57004, abs=1e-4)


def test_a_stop_in_glass_is_left_out_and_said() -> None:
    """The stop of small cameras stands around the front face, and that of some patents on a cemented one."""
    before = surface(9, "STOP", "CURV 0.0", "DISZ -1.5").replace("  STOP\n", "  STOP\n", 1)
    text = triplet().replace("  STOP\n", "").replace("SURF 1\n", before + "SURF 1\n")
    file = read_lens_zmx(text)
    assert file.prescription.stop_z_mm is None
    assert file.notes[-1] == (
        "line 12, SURF 9: this stop is left out, because it must be in the air, not in the glass from 0 to 3.259 mm; "
        "a stop that a job sets stands in the widest air space"
    )
    assert file.prescription.surfaces == prescription(triplet()).surfaces


@pytest.mark.parametrize("off_mm", [0.0, 4e-9, -4e-9])
def test_a_stop_at_a_vertex_stands_there_in_spite_of_rounding(off_mm: float) -> None:
    text = triplet().replace("  STOP\n", "").replace("DISZ 4.750409", f"DISZ {off_mm}")
    text = text.replace("SURF 5\n", surface(9, "STOP", "CURV 0.0", f"DISZ {4.750409 - off_mm!r}") + "SURF 5\n")
    lens = lens_of(prescription(text))
    assert lens.stop_z_mm == lens.vertices_mm[3]


def test_a_stop_of_its_own_is_no_surface() -> None:
    text = triplet().replace("  STOP\n", "").replace("DISZ 4.750409", "DISZ 2.0")
    text = text.replace("SURF 5\n", surface(9, "STOP", "CURV 0.0", "DISZ 2.750409") + "SURF 5\n")
    lens = prescription(text)
    assert len(lens.surfaces) == 6
    assert lens.surfaces[3].thickness_mm == pytest.approx(4.750409)
    assert lens.stop_z_mm == pytest.approx(12.266482)


@pytest.mark.parametrize(("unit", "mm"), [("MM", 1.0), ("CM", 10.0), ("IN", 25.4)])
def test_units_scale_lengths_and_terms(unit: str, mm: float) -> None:
    asphere = triplet().replace("UNIT MM", f"UNIT {unit}")
    asphere = asphere.replace(
        "SURF 1\n  TYPE STANDARD", "SURF 1\n  TYPE EVENASPH\n  CONI -1.5\n  PARM 2 1E-6\n  PARM 1 0"
    )
    lens, in_mm = lens_of(prescription(asphere)), lens_of(prescription(asphere.replace(f"UNIT {unit}", "UNIT MM")))
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
            "line 27, GLAS: expected a glass of Schott, Ohara, Hoya, CDGM, Hikari, Sumita by its name, or a catalogue "
            "that has it (--catalogue FILE.agf), got H-XYZ; the numbers behind the name, 1.5 40, are placeholders",
        ),
        ("SURF 3\n  TYPE STANDARD", "SURF 3\n  TYPE COORDBRK", "line 24, TYPE: expected one of STANDARD, EVENASPH"),
        ("SURF 3\n  TYPE STANDARD", "SURF 3\n  TYPE TOROIDAL", "other surfaces cannot be modelled, got TOROIDAL"),
        (
            "SURF 3\n  TYPE STANDARD",
            "SURF 3\n  TYPE EVENASPH\n  PARM 9 1",
            "line 25, PARM: expected terms of r^2 to r^16",
        ),
        ("DISZ 0.999975", "DISZ INFINITY", "line 26, DISZ: expected a finite distance, got INFINITY"),
        ("DISZ 0.999975", "DISZ -1", "line 23, SURF 3, thickness_mm: expected a number of at least 0, got -1.0"),
        ("GLAS F2 0 0 1.5 40", "GLAS H-XYZ 0 0 1 0", "got H-XYZ; the numbers behind the name, 1 0, are placeholders"),
        ("GLAS F2 0 0 1.5 40", "GLAS H-XYZ 0 0 0 0", "got H-XYZ; the numbers behind the name, 0 0, are placeholders"),
        ("GLAS F2 0 0 1.5 40 0 0 0", "GLAS H-XYZ", "(--catalogue FILE.agf), got H-XYZ"),
        ("GLAS F2 0 0", "GLAS H-K9 0 0", "(did you mean H-K9L"),
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
        ("DISZ 0.999975", "DISZ nan", "line 26, DISZ: expected a number, got nan"),
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


def test_a_lens_of_too_many_surfaces_is_refused() -> None:
    blocks = [surface(number, "CURV 0.001", "DISZ 1", "GLAS BK7", "DIAM 1") for number in range(1, 62)]
    with pytest.raises(SpecError, match=r"^expected a lens of at most 60 surfaces, got 61$"):
        read_lens_zmx(HEAD + OBJECT + "".join(blocks) + "SURF 62\n" + IMAGE)


@pytest.mark.parametrize("text", ["", "hello", HEAD, HEAD + OBJECT])
def test_a_file_without_surfaces_is_refused(text: str) -> None:
    with pytest.raises(SpecError, match="SURF blocks"):
        read_lens_zmx(text)


def without_diameters(text: str) -> str:
    return "".join(line for line in text.splitlines(keepends=True) if "DIAM" not in line)


def test_the_numbers_behind_an_unknown_name_are_used_where_they_are_real() -> None:
    file = read_lens_zmx(triplet().replace("GLAS F2 0 0 1.5 40", "GLAS FLINT-7 0 0 1.62004 36.37"))
    glass = file.prescription.surfaces[2]
    assert (glass.material, glass.index, glass.abbe) == (None, 1.62004, 36.37)
    assert file.notes == (
        "line 23, SURF 3: the glass FLINT-7 is unknown; its numbers in the file are used, index 1.62004 and Abbe "
        "number 36.37",
    )


def test_a_catalogue_comes_before_the_built_in_table_and_the_numbers_of_the_file() -> None:
    catalogue = read_agf("NM F2 5 0 1.7 30\nCD 1.7 0 0\nNM FLINT-7 5 0 1.6 30\nCD 1.6 0 0", title="own.agf")
    for name, index in (("F2", 1.7), ("FLINT-7", 1.6)):
        text = triplet().replace("GLAS F2 0 0 1.5 40", f"GLAS {name} 0 0 1.62 36")
        assert read_lens_zmx(text, GlassSearch([catalogue])).prescription.surfaces[2].index == index


def test_the_makers_that_the_file_names_come_first() -> None:
    for makers, index in (
        ("SCHOTT", 1.62004),
        ("CDGM SCHOTT", 1.61293),
        ("CORNING", 1.62004),
        ("CDGM-ZEMAX2019 SCHOTT", 1.61293),
    ):
        file = read_lens_zmx(triplet().replace("ENPD 10", f"ENPD 10\nGCAT {makers}"))
        assert file.prescription.surfaces[2].index == index


def test_semi_diameters_that_are_absent_are_computed_and_said() -> None:
    text = without_diameters(triplet()).replace("ENPD 10", "ENPD 10\nFTYP 0 0 2 1 0 0 0\nYFLN 0 20")
    file = read_lens_zmx(text)
    assert file.notes == (
        "SURF 1, SURF 2, SURF 3, SURF 4, SURF 5, SURF 6: the semi-diameter is computed from the rays of the file's "
        "aperture",
    )
    # The sample has 9.5, 5 and 7.5 mm, rounded up; its rays are within 10 % of them.
    found = [surface.semi_aperture_mm for surface in file.prescription.surfaces]
    assert found == pytest.approx([9.5, 9.5, 5.0, 5.0, 7.5, 7.5], rel=0.25)


def test_without_diameters_and_aperture_the_surface_is_named() -> None:
    with pytest.raises(SpecError, match=r"^line 10, SURF 1: expected a semi-diameter, or an aperture of"):
        read_lens_zmx(without_diameters(triplet()).replace("ENPD 10\n", ""))


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        ("ENPD 10", "MNUM 3 2\nENPD 10", "the file has 3 configurations; only number 2 is read, whose values its surf"),
        ("WAVM 1 0.55 1", "WAVM 1 10.6 1", "the file is designed for 10.6 micrometres"),
        ("WAVM 1 0.55 1", "PWAV 2\nWAVM 1 0.55 1\nWAVM 2 1.064 1", "the file is designed for 1.064 micrometres"),
        ("ENPD 10", "ENPD 10\nENVD 35 1 0", "the file's temperature of 35 degrees Celsius is ignored"),
    ],
)
def test_what_is_ignored_and_matters_is_said(old: str, new: str, note: str) -> None:
    assert read_lens_zmx(triplet().replace(old, new)).notes[0].startswith(note)


@pytest.mark.parametrize(
    ("aperture", "ignored"),
    [
        ("SQAP 8 6 0", "SQAP"),
        ("OBSC 0 2 0", "OBSC"),
        ("CLAP 2 9.5 0\n  OBDC 0 -4", "the hole of CLAP and OBDC"),
        ("CLAP 0 9.5 0\n  OBDC 0 0", ""),
    ],
)
def test_an_aperture_that_is_no_circle_is_said(aperture: str, ignored: str) -> None:
    file = read_lens_zmx(triplet().replace("DIAM 9.5 1 0 0 1\nSURF 2", f"DIAM 9.5 1 0 0 1\n  {aperture}\nSURF 2"))
    said = f"line 12, SURF 1: it is modelled with one round aperture, without {ignored}"
    assert file.notes == ((said,) if ignored else ())
    assert file.prescription == prescription(triplet())


@pytest.mark.parametrize(
    ("size", "semi_mm"), [("DIAM 14 0 0 0 1", 11.285), ("DIAM 14 1 0 0 1", 14.0), ("CLAP 0 14 0\n  DIAM 14 0", 14.0)]
)
def test_a_semi_diameter_that_zemax_computed_ends_where_the_faces_touch(size: str, semi_mm: float) -> None:
    """Spheres of R 22.0136 and -435.761 mm, 3.258956 mm apart, touch where their sags are 3.1127 and 0.1462 mm."""
    text = triplet().replace("DIAM 9.5 1 0 0 1", size)
    assert prescription(text).surfaces[0].semi_aperture_mm == pytest.approx(semi_mm, abs=0.015)


@pytest.mark.parametrize("curvature", ["6.3E-18", "-9.9E-8", "1e-320"])
def test_a_curvature_that_bends_no_light_is_a_plane(curvature: str) -> None:
    assert prescription(triplet().replace("CURV -2.2948389E-3", f"CURV {curvature}")).surfaces[1].radius_mm is None


def test_a_circular_aperture_stops_light_within_the_semi_diameter() -> None:
    text = triplet().replace("DIAM 9.5 1 0 0 1\nSURF 2", "DIAM 9.5 1 0 0 1\n  CLAP 0 9.1 0\nSURF 2")
    assert [one.semi_aperture_mm for one in prescription(text).surfaces[:2]] == [9.1, 9.5]


def test_the_files_own_numbers_of_surfaces_stay() -> None:
    before = surface(10, "CURV 0.0", "DISZ 1") + surface(11, "CURV 0.0", "DISZ 1")
    file = read_lens_zmx(triplet().replace("SURF 1\n", before + "SURF 1\n"))
    assert [place.rpartition(" ")[2] for place in file.places] == ["1", "2", "3", "4", "5", "6"]
    text = triplet().replace("SURF 1\n", before + "SURF 1\n").replace("DISZ 6.007551", "DISZ -6")
    with pytest.raises(SpecError, match=r"line 26, SURF 2, thickness_mm: expected a number of at least 0, got -6"):
        read_lens_zmx(text)


def test_planes_in_air_behind_the_lens_may_lie_before_it() -> None:
    text = triplet().replace("DISZ 42.20778", "DISZ -42.20778").replace("DISZ 4.750409", "DISZ -2")
    text = text.replace("SURF 5\n", surface(9, "CURV 0.0", "DISZ 6.750409") + "SURF 5\n")
    assert [one.thickness_mm for one in prescription(text).surfaces] == [
        one.thickness_mm for one in prescription(triplet()).surfaces
    ]


THORLABS_AC254_050_A = (
    (33.34, 9.0, "N-BAF10"),
    (-22.28, 2.5, "N-SF10"),
    (-291.07, 43.4, ""),
)


def test_a_catalogue_lens_has_the_focal_lengths_of_its_data_sheet() -> None:
    """Thorlabs AC254-050-A: f 50.2 mm, back focal length 43.4 mm."""
    blocks = [
        surface(number, f"CURV {1 / radius}", f"DISZ {t}", *([f"GLAS {name} 0 0 0 0"] if name else []), "DIAM 12.7")
        for number, (radius, t, name) in enumerate(THORLABS_AC254_050_A, start=1)
    ]
    points = cardinal_points(lens_of(prescription(HEAD + OBJECT + "".join(blocks) + "SURF 4\n" + IMAGE)))
    assert points.effective_focal_length_mm == pytest.approx(50.2, abs=0.05)
    assert points.back_focal_distance_mm == pytest.approx(43.4, abs=0.06)


def test_a_gas_is_air_and_said() -> None:
    gas = surface(2, "CURV -2.2948389E-3", "DISZ 6.007551", "GLAS NITROGEN 0 0 0.999712 0", "DIAM 9.5 1 0 0 1")
    text = triplet().replace(surface(2, "CURV -2.2948389E-3", "DISZ 6.007551", "DIAM 9.5 1 0 0 1"), gas)
    assert text != triplet()
    file = read_lens_zmx(text)
    assert file.prescription == prescription(triplet())
    assert file.notes[-1] == "line 18, SURF 2: the medium of index 0.999712 is taken for air"
    assert prescription(text.replace("NITROGEN 0 0 0.999712 0", "VACUUM")) == prescription(triplet())
