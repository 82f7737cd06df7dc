"""Lens designs of CODE V."""

from __future__ import annotations

import pytest

from lippmann.errors import SpecError
from lippmann.job.optics.lens import Prescription
from lippmann.optics.lens.matrices import cardinal_points
from lippmann.optics.lens.prescription import lens_of
from lippmann.optics.lens.published import TRONNIER_1954
from lippmann.optics.lens_files.codev.commands import MAX_WORDS, read_commands
from lippmann.optics.lens_files.codev.prescription import read_lens_seq

ACHROMAT = """\
RDM;LEN       "VERSION: 11.2       LENS VERSION: 84       Creation Date: today"
TITLE 'An achromat; 25 x 100'
EPD   25.0
DIM   M
WL    656.3 587.6 486.1
REF   2
WTW   1 1 1
TEM   20.0
INI   'LIP'
XAN   0.0
YAN   0.0
VUY   0.0
VLY   0.0
SO    0.0 0.1e14
S     61.47 6.0 NBK7_SCHOTT
  STO
  CIR 12.0
S     -44.64 2.5 NSF5_SCHOTT ! the cement
  CCY 0; THC 0
S     -129.94 95.95194415
  CIR EDG 12.5
  PIM
SI    0.0 0.0
GO
"""


def prescription(text: str) -> Prescription:
    return read_lens_seq(text).prescription


def paraxial(text: str) -> tuple[float, float]:
    """Return focal length and back focal distance by the y-nu trace of textbooks."""
    height, angle, index = 1.0, 0.0, 1.0
    for surface in prescription(text).surfaces:
        power = 0.0 if surface.radius_mm is None else (surface.index - index) / surface.radius_mm
        angle -= height * power  # The angle times the index.
        index = surface.index
        last = height
        height += surface.thickness_mm * angle / index
    return -1.0 / angle, -last / angle


def test_a_catalogue_lens_has_the_focal_lengths_of_its_data_sheet() -> None:
    """R 61.47, -44.64, -129.94 mm, N-BK7 and N-SF5: f 100 mm, back focal length 95.95 mm (Edmund Optics 32-327)."""
    focal_mm, back_mm = paraxial(ACHROMAT)
    assert focal_mm == pytest.approx(100.0, abs=0.05)
    assert back_mm == pytest.approx(95.952, abs=1e-3)
    points = cardinal_points(lens_of(prescription(ACHROMAT)))
    assert points.effective_focal_length_mm == pytest.approx(focal_mm, rel=1e-12)
    assert points.back_focal_distance_mm == pytest.approx(back_mm, rel=1e-12)


def test_what_the_file_says_is_kept() -> None:
    file = read_lens_seq(ACHROMAT)
    assert file.prescription.title == "An achromat; 25 x 100"
    assert file.places == ("line 15, S1", "line 18, S2", "line 20, S3")
    first, second, third = file.prescription.surfaces
    assert (first.radius_mm, first.thickness_mm, first.material) == (61.47, 6.0, "NBK7_SCHOTT")
    assert (first.semi_aperture_mm, third.semi_aperture_mm, third.index) == (12.0, 12.5, 1.0)
    assert 11.5 < second.semi_aperture_mm < 12.5
    assert file.notes == ("S2: the semi-diameter is computed from the rays of the file's aperture",)


def tronnier(*, curvatures: bool = False, unit_mm: float = 1.0) -> str:
    lines = ["RDM N" if curvatures else "RDM", "FNO 2.06", "YAN 0 10", "SO 0 inf"]
    for place, surface in enumerate(TRONNIER_1954.surfaces):
        radius = surface.radius_mm / unit_mm
        thickness = (5.705 if place == 4 else surface.thickness_mm) / unit_mm
        medium = "" if surface.index_after == 1 else f"{surface.index_after}:{surface.abbe_after}"
        lines.append(f"S {1 / radius if curvatures else radius!r} {thickness!r} {medium}")
        lines.append(f"  CIR {surface.semi_aperture_mm / unit_mm!r}")
        if place == 4:
            lines += [f"S 0 {4.5 / unit_mm!r}", "  STO"]
    return "\n".join([*lines, "SI 0 0"])


@pytest.mark.parametrize(
    ("dim", "unit_mm", "curvatures"), [("M", 1.0, False), ("M", 1.0, True), ("C", 10.0, True), ("I", 25.4, False)]
)
def test_a_patent_is_the_preset_in_every_unit_and_radius_mode(dim: str, unit_mm: float, curvatures: bool) -> None:
    file = read_lens_seq(f"DIM {dim}\n" + tronnier(curvatures=curvatures, unit_mm=unit_mm))
    lens = lens_of(file.prescription)
    for found, expected in zip(lens.surfaces, TRONNIER_1954.surfaces, strict=True):
        assert found.radius_mm == pytest.approx(expected.radius_mm, rel=1e-12)
        assert found.thickness_mm == pytest.approx(expected.thickness_mm, abs=2e-9)
        assert found.semi_aperture_mm == pytest.approx(expected.semi_aperture_mm, rel=1e-12)
        assert (found.index_after, found.abbe_after) == (expected.index_after, expected.abbe_after)
    assert lens.stop_z_mm == pytest.approx(16.885)
    assert file.places[5].endswith(", S7")  # The stop is S6.
    # The patent prints a back focus of 0.71436 f.
    points = cardinal_points(lens)
    assert points.back_focal_distance_mm / points.effective_focal_length_mm == pytest.approx(0.71436, abs=3e-5)


def test_commands_may_name_their_surface() -> None:
    text = "RDM\nEPD 5\nSO 0 inf\nS 10 1\nS -10 1\nSI\n"
    named = "rdy s1 50; thi s1 3; gla s1 bk7; cuy s2 -0.02; thi s2 20; k s2 -1; a s2 1e-5; c s2 2e-9; sto s1; cir s2 9"
    front, back = prescription(text + named).surfaces
    assert (front.radius_mm, front.thickness_mm, front.index) == (50.0, 3.0, 1.5168)
    assert (back.radius_mm, back.conic, back.aspheric, back.semi_aperture_mm) == (-50.0, -1.0, (1e-5, 0.0, 2e-9), 9.0)


@pytest.mark.parametrize(
    ("glass_name", "index", "abbe"),
    [
        ("BK7", 1.5168, 64.17),
        ("517642", 1.517, 64.2),
        ("517000.520000", 1.517, 52.0),
        ("1.62:36.4", 1.62, 36.4),
        ("SLAL8_OHARA", 1.713, 53.87),
        ("F5_CDGM", 1.62435, 35.94),
    ],
)
def test_glasses_are_written_in_many_ways(glass_name: str, index: float, abbe: float) -> None:
    front = prescription(ACHROMAT.replace("NBK7_SCHOTT", glass_name)).surfaces[0]
    assert front.index == pytest.approx(index, abs=1.1e-5)
    assert front.abbe == pytest.approx(abbe)


def test_a_private_glass_may_have_the_name_of_a_surface_or_a_catalogue_glass() -> None:
    for name in ("S1", "BK7", "SO", "A", "OWNGLASS"):
        file = read_lens_seq(
            f"PRV\nPWL 587.6\n'{name}' 1.61\nEND\n{ACHROMAT.replace('NBK7_SCHOTT', 'AIR')}\nGLA S1 '{name}'\n"
        )
        assert file.prescription.surfaces[0].index == 1.61
        text = ACHROMAT.replace("NBK7_SCHOTT", "AIR").replace("  STO", f"  STO; GLA '{name}'")
        assert prescription(f"PRV\nPWL 587.6\n'{name}' 1.61\nEND\n{text}").surfaces[0].index == 1.61


def test_without_rdm_the_numbers_are_curvatures_unless_they_are_too_great() -> None:
    for bends, kind, radius_mm in (((0.02, -0.02), "curvatures", 50.0), ((50.0, -80.0), "radii", 50.0)):
        file = read_lens_seq(f"EPD 5\nYAN 0\nSO 0 inf\nS {bends[0]} 3 BK7\nS {bends[1]} 50\nSI 0 0")
        assert file.notes[0].startswith(f"the file has no RDM: the numbers of its surfaces are read as {kind}")
        assert file.prescription.surfaces[0].radius_mm == pytest.approx(radius_mm)


@pytest.mark.parametrize(("aperture", "stop_mm"), [("FNO 5", 10.0), ("NA 0.0995037", 10.0), ("EPD 20", 10.0)])
def test_the_aperture_of_a_near_object_is_that_of_its_image(aperture: str, stop_mm: float) -> None:
    """A thin lens of f = 50 mm images 1:1 at 100 mm, where f/5 is a slope of 0.1; a far object would need 5 mm."""
    text = f"RDM\n{aperture}\nYOB 0\nSO 0 100\nS 51.68 4 1.5168:64\nSTO\nS -51.68 100\nSI 0 0\n"
    assert prescription(text).surfaces[0].semi_aperture_mm == pytest.approx(stop_mm, rel=0.05)


def test_a_file_needs_neither_object_nor_image() -> None:
    bare = "RDM\nEPD 5\nS 50 3 BK7\nS -80 50"
    assert prescription(bare) == prescription("RDM\nEPD 5\nSO 0 inf\nS 50 3 BK7\nS -80 50\nSI 0 0")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("NBK7_SCHOTT", "REFL", "line 15, S: expected a surface that refracts: mirrors cannot be modelled, got REFL"),
        ("NBK7_SCHOTT", "UNOBTAINIUM", "line 15, S: expected a glass of Schott, Ohara, Hoya"),
        ("  PIM", "  ADE 45", "line 22, ADE: expected only RDM DIM TIT SO S SI"),
        ("  PIM", "  YDE 1", "line 22, YDE: expected only"),
        ("  PIM", "  DIF DOE", "line 22, DIF: expected only"),
        ("  PIM", "  CUF 0.1", "line 22, CUF: expected only"),
        ("  PIM", "  CIR OBS 2", "line 22, CIR: expected a clear aperture; obscurations and holes cannot be modelled"),
        ("  PIM", "  THI S9 2", "line 22, THI: expected a surface from S0 to S3, got S9"),
        ("  PIM", "  K nan", "line 22, K: expected a finite number"),
        ("  PIM", "  A inf", "line 22, A: expected a finite number"),
        ("  PIM", "  ZOO 3", "line 22, ZOO: expected a lens of one zoom position: save each position as a lens of its"),
        ("  PIM", "  REX 5", "line 22, REX: expected a circular aperture (CIR), got 5"),
        ("  PIM", "  YDE S1 0.1", "line 22, YDE: expected only"),
        ("  PIM", "  CIR L'A'", "line 22, CIR: expected a number, got nothing"),
        ("  PIM", "  PIK GLA S1 S2", "line 22, PIK: expected a number for line 15, S1: solves and pickups are not"),
        ("  STO", "  STO; THI S1 0; THI HMY 0", "line 16, THI: expected a number for line 15, S1: solves and pickups"),
        ("  PIM", "  PIK", "line 22, PIK: expected a number for line 20, S3: solves and pickups are not computed"),
        ("-44.64 2.5", "-44.64 2.5; CUY inf", "line 18, S: expected a finite curvature"),
        ("GO", "S 5 5", "line 24, S: expected all surfaces before the image (SI)"),
        (
            "S     61.47 6.0",
            "S     61.47 -6.0",
            "line 15, S1, thickness_mm: expected glass of a thickness of at least 0, got -6",
        ),
        ("S     61.47 6.0", "S     61.47 inf", "line 15, S: expected a finite thickness"),
        ("S     61.47", "S     much", "line 15, S: expected a number"),
        ("DIM   M", "DIM   F", "line 4, DIM: expected M (mm), C (cm) or I (inches), got F"),
        ("YAN   0.0", "YAN   x", "line 11, YAN: expected a number, got x"),
        ("SO    0.0 0.1e14", "K 1\nSO 0 inf", "line 14, K: expected only"),
    ],
)
def test_what_cannot_be_modelled_is_refused_with_its_line(old: str, new: str, problem: str) -> None:
    assert old in ACHROMAT
    with pytest.raises(SpecError) as caught:
        read_lens_seq(ACHROMAT.replace(old, new, 1))
    assert problem in caught.value.message


@pytest.mark.parametrize("plane", ["0", "0.0", "inf", "1e18", "-0.1e14"])
def test_planes_are_written_in_many_ways(plane: str) -> None:
    assert prescription(ACHROMAT.replace("-129.94", plane)).surfaces[2].radius_mm is None


def test_solves_and_pickups_are_not_computed_and_said() -> None:
    """A file that CODE V writes has the numbers beside the solves; the distance behind the last surface is none."""
    solves = "  THI HMY 0.0\nPIK RDY S3 Z1 RDY S2 Z1\nPIK THI S2 THI S1 0.5\nCUY S1 UMY -0.1\n"
    file = read_lens_seq(ACHROMAT.replace("  PIM\n", solves))
    assert file.prescription == prescription(ACHROMAT)
    assert file.notes[:3] == (
        "line 25, CUY: solves and pickups are not computed; the number of line 15, S1 is used",
        "line 24, PIK: solves and pickups are not computed; the number of line 18, S2 is used",
        "line 23, PIK: solves and pickups are not computed; the number of line 20, S3 is used",
    )


def test_decentres_of_0_and_labels_of_apertures_change_nothing() -> None:
    harmless = (
        "  XDE 0.0; YDE 0; ZDE 0.0\n  ADE 0.0; BDE 0.0; CDE 0.0; ADX 0; ADY 0\n  CUF 0.0\nCA\nPOL N\n  CIR L'A' 12.5\n"
    )
    assert prescription(ACHROMAT.replace("  PIM\n", harmless)) == prescription(ACHROMAT)


@pytest.mark.parametrize(
    "aperture",
    [
        "CIR EDG 12.5",
        "CIR L'A' EDG 12.5",
        "CIR EDG L'A' 12.5",
        "CIR EDG S3 12.5",
        "CIR S3 EDG 12.5",
        "cir s3 l'a' 12.5",
    ],
)
def test_the_words_of_an_aperture_may_have_any_order(aperture: str) -> None:
    without = ACHROMAT.replace("  CIR EDG 12.5\n", "")
    text = without + aperture if "S3" in aperture.upper() else without.replace("  PIM", aperture)
    assert prescription(text) == prescription(ACHROMAT)


@pytest.mark.parametrize("aperture", ["CIR S1 OBS 2", "CIR OBS S1 2", "CIR L'A' HOL 2"])
def test_an_obscuration_is_refused_in_any_order(aperture: str) -> None:
    with pytest.raises(SpecError, match="obscurations and holes cannot be modelled"):
        read_lens_seq(ACHROMAT.replace("  PIM", f"  {aperture}"))


def test_the_last_sto_names_the_stop() -> None:
    assert prescription(ACHROMAT + "STO S3") == prescription(ACHROMAT.replace("  STO\n", "").replace("  PIM", "  STO"))


@pytest.mark.parametrize("text", ["", "hello", "SO 0 inf", "SO 0 inf\nS 5 5\nSI 0 0", "RDM\nSO\nSI"])
def test_a_file_without_a_lens_is_refused(text: str) -> None:
    with pytest.raises(SpecError):
        read_lens_seq(text)


@pytest.mark.parametrize(
    ("command", "note"),
    [("WL 10600", "the file is designed for 10.6 micrometres"), ("TEM 35", "the file's temperature of 35 degrees")],
)
def test_what_is_ignored_and_matters_is_said(command: str, note: str) -> None:
    notes = read_lens_seq(ACHROMAT.replace("REF   2", "").replace("XAN   0.0", command)).notes
    assert any(one.startswith(note) for one in notes)


def test_commands_are_counted() -> None:
    with pytest.raises(SpecError, match="line 2: expected at most 2,000 words in a command, got more"):
        list(read_commands("S " + "1 " * (MAX_WORDS - 1) + "&\n1 1"))
