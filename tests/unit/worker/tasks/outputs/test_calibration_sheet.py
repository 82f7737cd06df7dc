"""Calibration sheets as outputs of a job and by the command, read by other programs than ours."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pypdf
import pytest
from PIL import Image

from lippmann.errors import BadInput, SpecError
from lippmann.job.spec import parse_spec
from lippmann.local.calibration_sheet import write_calibration_sheet
from tests.builders_outputs import given_job
from tests.pictures import read_tiff, tags_of_tiff

POINT_MM = 25.4 / 72
PIXEL_MM = 25.4 / 300
SMALL = {"steps": 3, "strip_mm": 2, "length_mm": 20}


def test_a_pdf_has_a_page_across_and_a_page_down(tmp_path: Path) -> None:
    job = given_job(tmp_path, outputs=[{"kind": "calibration_sheet", "dpi": 300, **SMALL}])
    job.make("calibration_sheet.pdf")
    pages = job.sidecar("calibration_sheet.pdf")["format"]
    with job.file("exports/calibration_sheet/calibration_sheet.pdf") as path:
        reader = pypdf.PdfReader(path, strict=True)
        assert len(reader.pages) == 2
        for page, direction in zip(reader.pages, ("across", "down"), strict=True):
            rows, cols = pages[direction]["page_px"]
            sides = [float(side) * POINT_MM for side in page.mediabox.upper_right]
            assert sides == pytest.approx([cols * PIXEL_MM, rows * PIXEL_MM], abs=1e-4)
            assert f"Calibration sheet, {direction}" in page.extract_text()
            assert "0.99" in page.extract_text()
        assert reader.trailer["/Root"]["/ViewerPreferences"]["/PrintScaling"] == "/None"  # type: ignore[index]  # a dictionary


def test_pictures_are_one_for_each_direction_with_the_devices_density(tmp_path: Path) -> None:
    job = given_job(tmp_path, outputs=[{"kind": "calibration_sheet", "dpi": 300, "file_format": "tiff", **SMALL}])
    job.make("calibration_sheet.tif")
    said = job.sidecar("calibration_sheet.tif")
    assert said["files"] == [f"exports/calibration_sheet/calibration_sheet-{way}.tif" for way in ("across", "down")]
    for name, direction in zip(said["files"], ("across", "down"), strict=True):
        with job.file(name) as path:
            codes = read_tiff(path)
            assert tags_of_tiff(path)["XResolution"] == 300
        assert list(codes.shape[:2]) == said["format"][direction]["page_px"]
        assert [strip["bands_mm"] for strip in said["format"][direction]["strips"]] == [
            pytest.approx(99),
            None,
            pytest.approx(101),
        ]
        for strip in said["format"][direction]["strips"]:
            left, top, wide, high = (
                round(strip[side] / PIXEL_MM) for side in ("left_mm", "top_mm", "width_mm", "height_mm")
            )
            lines = codes[top : top + high, left : left + wide, 0]
            assert set(np.unique(lines)) == {0, 255}  # no greys: lines are whole pixels
            assert (lines == 0).mean() == pytest.approx(0.5, abs=0.06)
            along = lines[high // 2] if direction == "across" else lines[:, wide // 2]
            assert (np.diff(along.astype(int)) < 0).sum() == 20 // strip["pitch_mm"] - 1


@pytest.mark.parametrize("suffix", [".pdf", ".tif", ".png"])
def test_the_command_writes_by_the_suffix_and_names_its_files(tmp_path: Path, suffix: str) -> None:
    options = {"dpi": 300.0, "pitch_um": None, "steps": 3, "length_mm": 20.0}
    files = write_calibration_sheet(tmp_path / f"my{suffix}", pitch_mm=1.0, lattice="hexagonal", options=options)
    names = ["my.pdf"] if suffix == ".pdf" else [f"my-across{suffix}", f"my-down{suffix}"]
    assert [file.name for file in files] == names
    assert sorted(file.name for file in tmp_path.iterdir()) == names
    if suffix != ".pdf":
        for file in files:
            with Image.open(file) as picture:
                assert picture.info["dpi"] == pytest.approx((300, 300), abs=0.01)


@pytest.mark.parametrize(
    ("file", "options", "said"),
    [
        ("a.doc", {"dpi": 300}, "ends in one of .pdf, .tif, .png, got"),
        ("a.pdf", {}, "either --dpi or --pitch-um, got neither"),
        ("a.pdf", {"dpi": 300, "pitch_um": 40}, "either --dpi or --pitch-um, got both"),
        ("a.pdf", {"dpi": 50}, "--dpi: expected pixels of at most 247.5 um, .* got 508 um"),
        ("a.pdf", {"pitch_um": 500}, "--pitch-um: expected pixels of at most"),
        ("a.pdf", {"dpi": 300, "steps": 1}, "--steps: expected a number of at least 3, got 1"),
        ("a.pdf", {"dpi": 300, "pitch_mm": -1}, "--pitch-mm: expected a number above 0, got -1"),
        ("a.pdf", {"dpi": 300, "length_mm": 5}, "--length-mm: expected at least ten lenses, 10 mm, got 5"),
    ],
)
def test_the_command_says_which_option_is_wrong(tmp_path: Path, file: str, options: dict[str, Any], said: str) -> None:
    pitch_mm = options.pop("pitch_mm", 1.0) if "pitch_mm" in options else 1.0
    with pytest.raises(BadInput, match=said):
        write_calibration_sheet(
            tmp_path / file, pitch_mm=pitch_mm, lattice="square", options={"dpi": None, "pitch_um": None, **options}
        )
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("output", "field", "expected"),
    [
        ({}, "dpi", "this or pitch_um"),
        ({"dpi": 50}, "dpi", "a quarter of what lines are apart"),
        ({"dpi": 2400, "length_mm": 1000}, "length_mm", "at most 32768 px a side"),
        ({"dpi": 2400, "steps": 201}, "steps", "at most 32768 px a side"),
    ],
)
def test_a_sheet_that_cannot_be_is_said_when_the_job_arrives(output: dict[str, Any], field: str, expected: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec({"scene": "fish", "outputs": [{"kind": "calibration_sheet", "strip_mm": 2, **output}]})
    (problem,) = refused.value.problems
    assert problem.field == f"outputs.0.{field}"
    assert expected in problem.expected
