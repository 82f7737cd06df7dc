"""Pictures as cameras and other programs write them, through the command: pages, JPEG, sensors, white frames."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image
from typer.testing import CliRunner

from lippmann.cli.main import app
from lippmann.lattice.layout import CellLayout
from lippmann.local.image import open_orthoscopic
from tests.unit.lippmann.lightfield.sheets import numbered_sheet
from worker.images.colour import srgb_codes
from worker.sandbox.bundle import check_bundle, pack_folder

LAYOUT = CellLayout(5, 6, 8)
SIZE = (LAYOUT.rows, LAYOUT.cols)
GRID = ("--pitch-px", 8)


def _run(*words: object) -> Any:
    ran = CliRunner().invoke(app, ["import", *map(str, words)])
    assert ran.exit_code == 0, f"{ran.output} {ran.exception}"
    return ran


def _light(out: Path, frame: int = 1) -> np.ndarray[Any, Any]:
    return np.asarray(open_orthoscopic(out / f"orthoscopic/{frame:04d}.exr").pixels).astype(np.float32)


def _codes(part: float = 1.0) -> np.ndarray[Any, Any]:
    sheet = numbered_sheet(LAYOUT)
    return np.asarray(srgb_codes((part * sheet / sheet.max()).astype(np.float32)))


def test_the_pages_of_a_tiff_are_frames_here_and_in_the_bundle(tmp_path: Path) -> None:
    pages = [_codes(part) for part in (1.0, 0.6, 0.3)]
    with tifffile.TiffWriter(tmp_path / "several.tif") as file:
        for page in pages:
            file.write(page, photometric="rgb", metadata=None)
    Image.fromarray(pages[0]).save(tmp_path / "one.png")
    out, bundle = tmp_path / "out", tmp_path / "bundle"
    ran = _run(tmp_path / "several.tif", tmp_path / "one.png", *GRID, "--out", out, "--bundle", bundle)
    assert "several.tif: its 3 pages are the frames 1 to 3." in ran.stderr
    for frame, page in enumerate([*pages, pages[0]], start=1):
        assert np.array_equal(srgb_codes(_light(out, frame)), page)
    listed = tomllib.loads((bundle / "scene.toml").read_text())["sheets"]["files"]
    assert listed == ["frames/0001.tif#1", "frames/0001.tif#2", "frames/0001.tif#3", "frames/0002.png"]
    sheets = check_bundle(pack_folder(bundle)).card.sheets
    assert sheets is not None
    assert list(sheets.files) == listed


def test_a_jpeg_is_imported_and_its_quality_is_said(tmp_path: Path) -> None:
    Image.fromarray(np.full((*SIZE, 3), 100, np.uint8)).save(tmp_path / "photo.JPG", quality=85)
    ran = _run(tmp_path / "photo.JPG", *GRID, "--out", tmp_path / "out")
    assert "photo.JPG: it is a JPEG of quality 85 with 4:2:0 chroma" in ran.stderr
    assert np.array_equal(srgb_codes(_light(tmp_path / "out")), np.full((*SIZE, 3), 100, np.uint8))


def test_a_picture_that_is_stored_sideways_is_imported_upright(tmp_path: Path) -> None:
    Image.fromarray(np.rot90(_codes())).save(tmp_path / "o6.tif", tiffinfo={274: 6})
    ran = _run(tmp_path / "o6.tif", *GRID, "--out", tmp_path / "out")
    assert "its orientation tag is 6, so it is turned upright" in ran.stderr
    assert np.array_equal(srgb_codes(_light(tmp_path / "out")), _codes())


def test_twelve_bits_in_sixteen_are_noted_and_read_with_their_white_level(tmp_path: Path) -> None:
    tifffile.imwrite(tmp_path / "raw.tif", np.full(SIZE, 4095, np.uint16), photometric="minisblack")
    ran = _run(tmp_path / "raw.tif", *GRID, "--out", tmp_path / "dark", "--linear")
    assert "none is above 4095. If a sensor of 12 bits wrote them, give --white-level 4095" in ran.stderr
    np.testing.assert_allclose(_light(tmp_path / "dark"), 4095 / 65535, rtol=1e-3)
    words = ("--out", tmp_path / "out", "--linear", "--white-level", 4095, "--bundle", tmp_path / "bundle")
    ran = _run(tmp_path / "raw.tif", *GRID, *words)
    assert "--white-level" not in ran.stderr
    assert np.array_equal(_light(tmp_path / "out"), np.ones((*SIZE, 3)))
    sheets = tomllib.loads((tmp_path / "bundle/scene.toml").read_text())["sheets"]
    assert (sheets["white_level"], sheets["linear"]) == (4095, True)


def test_no_white_level_is_proposed_where_none_can_be_given(tmp_path: Path) -> None:
    codes = np.full(SIZE, 1023, ">u2")
    (tmp_path / "own.pgm").write_bytes(b"P5 %d %d 4095\n" % SIZE[::-1] + codes.tobytes())
    tifffile.imwrite(tmp_path / "negative.tif", 65535 - codes.astype(np.uint16), photometric="miniswhite")
    for name in ("own.pgm", "negative.tif"):
        ran = _run(tmp_path / name, *GRID, "--out", tmp_path / f"out-{name}")
        assert "--white-level" not in ran.stderr


def test_numbers_that_are_not_finite_are_noted(tmp_path: Path) -> None:
    light = np.full((*SIZE, 3), 0.5, np.float32)
    light[3, 4] = np.nan, np.inf, 0.5
    tifffile.imwrite(tmp_path / "a.tif", light, photometric="rgb")
    ran = _run(tmp_path / "a.tif", *GRID, "--out", tmp_path / "out")
    assert f"a.tif: 2 of its {light.size} numbers are not finite; they are kept" in ran.stderr


@pytest.mark.parametrize(("size", "said"), [((8, 6), "8 x 6 px in .*a.tif#2; save the pages"), (SIZE[::-1], None)])
def test_frames_of_another_size_are_refused_before_one_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, size: tuple[int, int], said: str | None
) -> None:
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        for cols, rows in (SIZE[::-1], size):
            file.write(np.zeros((rows, cols, 3), np.uint8), photometric="rgb", metadata=None)
    words = ["import", str(tmp_path / "a.tif"), *map(str, GRID), "--out", str(tmp_path / "out")]
    if said is not None:
        monkeypatch.setattr("lippmann.local.importing.import_sheets.read_picture", pytest.fail)
    ran = CliRunner().invoke(app, words)
    assert (ran.exit_code == 0) == (said is None)
    assert said is None or re.search(said, str(ran.exception))


def test_a_white_frame_takes_the_vignetting_away(tmp_path: Path) -> None:
    rows, cols = (np.arange(side) / side - 0.5 for side in SIZE)
    fall = (1 - rows[:, np.newaxis] ** 2 - cols**2)[..., np.newaxis] * np.array([0.9, 0.8, 0.5])
    shown = numbered_sheet(LAYOUT) / numbered_sheet(LAYOUT).max() / 2
    for name, light in (("white", fall), ("dim", fall / fall.max(axis=(0, 1)) * shown)):
        tifffile.imwrite(tmp_path / f"{name}.tif", light.astype(np.float32), photometric="rgb")
    words = ("--white", tmp_path / "white.tif", "--out", tmp_path / "out", "--bundle", tmp_path / "bundle")
    _run(tmp_path / "dim.tif", *GRID, *words)
    np.testing.assert_allclose(_light(tmp_path / "out"), shown, rtol=0.01, atol=1e-4)
    sheets = tomllib.loads((tmp_path / "bundle/scene.toml").read_text())["sheets"]
    assert sheets["white"] == "white.tif"
    assert (tmp_path / "bundle/white.tif").is_file()


@pytest.mark.parametrize(
    ("white", "said"),
    [
        (np.ones((4, 4, 3), np.float32), "expected a white image of 48 x 40 px as the picture, got 4 x 4 px"),
        (np.zeros((*SIZE, 3), np.float32), "expected a white image, got one without light"),
    ],
)
def test_a_white_frame_that_cannot_be_is_refused(tmp_path: Path, white: np.ndarray[Any, Any], said: str) -> None:
    tifffile.imwrite(tmp_path / "white.tif", white, photometric="rgb")
    Image.fromarray(_codes()).save(tmp_path / "a.png")
    words = (tmp_path / "a.png", *GRID, "--white", tmp_path / "white.tif", "--out", tmp_path / "out")
    ran = CliRunner().invoke(app, ["import", *map(str, words)])
    assert ran.exit_code != 0
    assert said in str(ran.exception)
    assert not (tmp_path / "out").exists()
