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


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "latin-1"])
def test_a_zemax_file_is_read_in_any_of_its_encodings(tmp_path: Path, encoding: str) -> None:
    found = read_lens(stored(tmp_path, "LENS.ZMX", ZMX.replace("\n", "\r\n").encode(encoding)))
    assert found["title"] == "Größe 10 µm"
    assert [row["radius_mm"] for row in found["surfaces"]] == pytest.approx([60.0, -60.0])


def test_a_file_is_a_lens_that_a_job_takes(tmp_path: Path) -> None:
    from_csv = read_lens(stored(tmp_path, "biconvex.csv", CSV.encode()))
    assert from_csv["title"] == "biconvex"
    from_json = read_lens(stored(tmp_path, "lens.json", json.dumps(from_csv).encode()))
    assert from_json == from_csv
    assert job_lens(from_csv) is not None


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("lens.txt", b"", "expected a lens as .json, .csv, .zmx, got lens.txt"),
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
    with pytest.raises(SpecError, match=r"surfaces\.0\.semi_aperture_mm: expected a value, got nothing"):
        read_lens(stored(tmp_path, "lens.json", b'{"surfaces": [{"radius_mm": 5, "index": 1.5}]}'))


@pytest.mark.parametrize("name", IMAGING_LENSES)
def test_a_lens_is_shown_as_a_job_takes_it(capsys: pytest.CaptureFixture[str], name: str) -> None:
    lens(name, output=Output(as_json=True))
    shown = json.loads(capsys.readouterr().out)
    assert job_lens(shown["imaging_lens"]) is not None
    assert {"efl_mm", "back_focal_mm", "front_focal_mm", "f_number"} < shown.keys()


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
    with pytest.raises(OpticsError, match="do not cross inside their apertures"):
        lens(str(path), output=Output(as_json=False))


def test_an_unknown_lens_names_the_known_ones() -> None:
    with pytest.raises(BadInput, match="expected one of athineos-2006"):
        lens("nikon", output=Output(as_json=False))
