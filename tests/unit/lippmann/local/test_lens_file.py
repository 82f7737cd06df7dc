"""Files of imaging lenses, and what is shown of a lens."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from lippmann.cli.commands.lens import lens
from lippmann.errors import BadInput, OpticsError, SpecError
from lippmann.job.spec import parse_spec
from lippmann.local.files.lens import read_lens
from lippmann.optics.lens.prescription import rig_lens
from lippmann.optics.lens.published import IMAGING_LENSES
from lippmann.terminal.output import Output

CSV = "radius;thickness;material;index;v-no;sa\n60;8;BK7;;;15\n-60;;;;;15\n"
ZMX = (
    "MODE SEQ\nNAME Größe 10 µm\nUNIT MM\n"
    "SURF 0\n  TYPE STANDARD\n  CURV 0\n  DISZ INFINITY\n"
    "SURF 1\n  TYPE STANDARD\n  CURV 0.016666666666666666\n  DISZ 8\n  GLAS N-BK7 0 0\n  DIAM 15\n"
    "SURF 2\n  TYPE STANDARD\n  CURV -0.016666666666666666\n  DISZ 50\n  DIAM 15\n"
    "SURF 3\n  TYPE STANDARD\n  CURV 0\n  DISZ 0\n"
)


def stored(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


def job_lens(prescription: object) -> object:
    return rig_lens(parse_spec({"scene": "fish", "rig": {"imaging_lens": prescription}}).rig)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_a_zemax_file_is_read_in_any_of_its_encodings(tmp_path: Path, encoding: str) -> None:
    found = read_lens(stored(tmp_path, "LENS.ZMX", ZMX.replace("\n", "\r\n").encode(encoding))).prescription
    assert found.title == "Größe 10 µm"
    assert [row.radius_mm for row in found.surfaces] == pytest.approx([60.0, -60.0])


def test_text_files_of_dos_and_macintosh_are_read_with_their_own_line_numbers(tmp_path: Path) -> None:
    for line_end in ("\n", "\r\n", "\r"):
        # In cp1252 the byte 0x85 is a character, in Latin-1 a control character that `str.splitlines` cuts at.
        data = SEQ.replace("own", "o\x85n").replace("\n", line_end).encode("latin-1") + b"\x1a"
        file = read_lens(stored(tmp_path, "lens.seq", data))
        assert file.prescription.title == "o\u2026n"
        assert file.places == ("line 6, S1", "line 8, S2")
    read_lens(stored(tmp_path, "lens.csv", CSV.encode() + b"\x1a"))


def test_a_file_is_a_lens_that_a_job_takes(tmp_path: Path) -> None:
    from_csv = read_lens(stored(tmp_path, "biconvex.csv", CSV.encode())).prescription
    assert from_csv.title == "biconvex"
    dumped = from_csv.model_dump(mode="json", exclude_defaults=True)
    assert read_lens(stored(tmp_path, "lens.json", json.dumps(dumped).encode())).prescription == from_csv
    assert job_lens(dumped) is not None


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("lens.txt", b"", "expected a lens as .json, .csv, .zmx, .seq, got lens.txt"),
        ("lens", b"", "expected a lens as .json, .csv, .zmx, .seq, got lens"),
        ("lens.json", b"{", "expected JSON, got .* at line 1, column 2"),
        ("lens.csv", b"\xff\xfe\xfd", "expected text in UTF-8"),
    ],
)
def test_a_file_that_is_no_lens_is_refused(tmp_path: Path, name: str, data: bytes, problem: str) -> None:
    with pytest.raises(BadInput, match=problem):
        read_lens(stored(tmp_path, name, data))


def test_a_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="No such file"):
        read_lens(tmp_path / "none.csv")


def test_json_with_unknown_fields_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match=r"^lens.json: surfaces\.0\.semi_aperture_mm: expected a value, got nothing"):
        read_lens(stored(tmp_path, "lens.json", b'{"surfaces": [{"radius_mm": 5, "index": 1.5}]}'))


@pytest.mark.parametrize("name", IMAGING_LENSES)
def test_a_lens_is_shown_as_a_job_takes_it(capsys: pytest.CaptureFixture[str], name: str) -> None:
    lens(name, output=Output(as_json=True))
    shown = json.loads(capsys.readouterr().out)
    assert job_lens(shown["imaging_lens"]) is not None
    assert {"efl_mm", "back_focal_distance_mm", "front_focal_distance_mm", "f_number"} < shown.keys()


def test_a_lens_is_shown_surface_by_surface(capsys: pytest.CaptureFixture[str]) -> None:
    lens("athineos-2006", output=Output(as_json=False))
    said = capsys.readouterr().out
    assert "300.4678 mm" in said
    assert "-242.38" in said


def test_without_a_name_all_lenses_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    lens(None, output=Output(as_json=False))
    said = capsys.readouterr().out
    assert all(name in said for name in IMAGING_LENSES)


def test_a_lens_from_a_file_is_checked(tmp_path: Path) -> None:
    path = stored(tmp_path, "thin.csv", CSV.replace("60;8", "60;2").encode())
    with pytest.raises(OpticsError, match=r"^thin\.csv: line 2, thickness_mm: expected .* do not cross inside"):
        lens(str(path), output=Output(as_json=False))


def test_an_unknown_lens_names_the_known_ones() -> None:
    with pytest.raises(BadInput, match="expected one of athineos-2006"):
        lens("nikon", output=Output(as_json=False))


SEQ = """\
RDM;LEN
TITLE "own"
EPD 20
YAN 0 5
SO 0 1e10
S 100 5 BK7_SCHOTT
  STO
S -100 95
SI 0 0
GO
"""
AGF = "NM OWN-1 5 0 1.6 50\nCD 1.6 0.01\nTD 0 0 0 0 0 0 20\n"


def test_a_codev_file_is_shown_with_its_own_numbers_and_notes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lens(str(stored(tmp_path, "lens.seq", SEQ.encode())), output=Output(as_json=False))
    said, noted = capsys.readouterr()
    rows = [line.split()[:2] for line in said.splitlines()]
    assert ["S1", "100"] in rows
    assert ["S2", "-100"] in rows
    assert noted == "note: S1, S2: the semi-diameter is computed from the rays of the file's aperture\n"


def test_catalogues_give_the_glasses_of_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = stored(tmp_path, "lens.seq", SEQ.replace("BK7_SCHOTT", "OWN-1").encode())
    catalogues = [
        stored(tmp_path, "one.agf", b"NM OTHER 5 0\nCD 1.5"),
        stored(tmp_path, "TWO.AGF", AGF.encode("utf-16")),
    ]
    with pytest.raises(
        SpecError, match=r"^lens\.seq: line 6, S: expected a glass of Schott.*\(--catalogue FILE\.agf\)"
    ):
        lens(str(path), output=Output(as_json=True))
    lens(str(path), catalogues=catalogues, output=Output(as_json=True))
    shown = json.loads(capsys.readouterr().out)
    assert shown["imaging_lens"]["surfaces"][0]["index"] == pytest.approx(1.6 + 0.01 / 0.5875618)
    assert shown["notes"][0].startswith("TWO.AGF: the temperature data is ignored")


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("own.txt", AGF, r"^expected a glass catalogue as \.agf, got own\.txt$"),
        ("own.agf", "", r"^own\.agf: \(whole\): expected a catalogue with NM lines"),
        ("own.agf", "NM G x", r"^own\.agf: line 1, NM G: expected a finite number, got 'x'$"),
    ],
)
def test_a_file_that_is_no_catalogue_is_refused(tmp_path: Path, name: str, data: str, problem: str) -> None:
    path = stored(tmp_path, "lens.seq", SEQ.encode())
    with pytest.raises((BadInput, SpecError), match=problem):
        read_lens(path, [stored(tmp_path, name, data.encode())])
    with pytest.raises(BadInput, match=r"expected a glass catalogue, got .*gone\.agf: No such file"):
        read_lens(path, [tmp_path / "gone.agf"])


@pytest.mark.parametrize(
    ("name", "problem"),
    [
        ("gone.seq", r"expected a lens file, got .*gone\.seq: No such file"),
        ("lens.zar", r"^expected a lens as \.json, \.csv, \.zmx, \.seq, got lens\.zar$"),
        ("own.agf", r"got own\.agf \(a glass catalogue goes with --catalogue\)$"),
        ("folder", r"^expected a lens as \.json, \.csv, \.zmx, \.seq, got folder$"),
    ],
)
def test_what_is_no_lens_file_is_named(tmp_path: Path, name: str, problem: str) -> None:
    (tmp_path / "folder").mkdir()
    with pytest.raises(BadInput, match=problem):
        lens(str(tmp_path / name), output=Output(as_json=False))


def test_a_lens_without_semi_diameters_and_aperture_is_told_the_words(tmp_path: Path) -> None:
    path = stored(tmp_path, "lens.seq", SEQ.replace("EPD 20\n", "").encode())
    with pytest.raises(SpecError, match=r"line 5, S1: expected a semi-diameter, or .* \(CIR; EPD, FNO, NA, NAO\)"):
        read_lens(path)
    path = stored(tmp_path, "lens.zmx", ZMX.replace("  DIAM 15\n", "").encode())
    with pytest.raises(SpecError, match=r"line 8, SURF 1: expected a .* \(DIAM; ENPD, FNUM, OBNA, FLOA\)"):
        read_lens(path)


@pytest.mark.parametrize("name", ["cook-triplet", "cooke", "Cooke-Triplet"])
def test_a_name_that_is_nearly_right_is_suggested(name: str) -> None:
    with pytest.raises(BadInput, match=r"\(did you mean cooke-triplet\?\), or a file \(.json, .csv, .zmx, .seq\)"):
        lens(name, output=Output(as_json=False))


def test_catalogues_belong_to_files(tmp_path: Path) -> None:
    for name in ("cooke-triplet", None):
        with pytest.raises(BadInput, match=r"expected .*--catalogue with a lens"):
            lens(name, catalogues=[tmp_path / "own.agf"], output=Output(as_json=False))


def test_errors_behind_the_reader_name_the_files_surface(tmp_path: Path) -> None:
    path = stored(tmp_path, "thin.zmx", ZMX.replace("DISZ 8", "DISZ 1").encode())
    with pytest.raises(OpticsError, match=r"^thin\.zmx: line 8, SURF 1, thickness_mm: expected at least"):
        read_lens(path)
    path = stored(tmp_path, "flat.seq", SEQ.replace("100 5", "0 5").replace("-100 95", "0 95").encode())
    with pytest.raises(OpticsError, match=r"^flat\.seq: \(whole\): expected a lens that bends light"):
        read_lens(path)
