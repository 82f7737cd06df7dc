"""Integral images from elsewhere through the command."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from lippmann.cli.main import app
from lippmann.job.optics.rig import LensArray, Rig
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.lens_grid import LensGrid
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells, orthoscopic
from lippmann.lightfield.views.views import views_grid
from lippmann.local.image import open_orthoscopic
from tests.unit.lippmann.lightfield.lens_pictures import white_image
from tests.unit.lippmann.lightfield.sheets import numbered_sheet
from worker.images.read import read_rgb
from worker.images.write import write_exr

LAYOUT = CellLayout(6, 7, 8)


def _run(*words: object) -> Any:
    return CliRunner().invoke(app, ["import", *map(str, words)])


def _sheet(layout: CellLayout = LAYOUT) -> np.ndarray[Any, np.dtype[np.float32]]:
    sheet = numbered_sheet(layout)
    held: np.ndarray[Any, np.dtype[np.float32]] = (sheet / sheet.max()).astype(np.float16).astype(np.float32)
    return held


def _exr(path: Path, pixels: np.ndarray[Any, Any]) -> Path:
    write_exr(path, pixels, attributes={})
    return path


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ((), lambda sheet: sheet),
        (("--pseudoscopic",), lambda sheet: half_turn_cells(sheet, LAYOUT)),
        (("--pseudoscopic", "--inverted"), lambda sheet: orthoscopic(sheet, LAYOUT)),
        (("--inverted",), lambda sheet: sheet[::-1, ::-1]),
    ],
)
def test_whole_cells_pass_as_they_are_but_for_what_must_be_turned(
    tmp_path: Path, options: tuple[str, ...], expected: Any
) -> None:
    sheet = _sheet()
    ran = _run(_exr(tmp_path / "a.exr", sheet), "--pitch-px", 8, "--out", tmp_path / "out", *options)
    assert ran.exit_code == 0, ran.output
    master = open_orthoscopic(tmp_path / "out/orthoscopic/0001.exr")
    assert master.layout == LAYOUT
    assert np.array_equal(master.pixels, expected(sheet))
    views = read_rgb(tmp_path / "out/views/0001.exr", np.float16)
    assert np.array_equal(views, views_grid(master.pixels, LAYOUT))
    assert (tmp_path / "out/thumbs/0001.webp").is_file()


def test_several_files_are_frames(tmp_path: Path) -> None:
    files = [_exr(tmp_path / f"{name}.exr", _sheet() * part) for name, part in (("a", 1), ("b", 0.5))]
    ran = _run(*files, "--pitch-px", 8, "--out", tmp_path / "out", "--json", "--pitch-mm", 2, "--focal-length-mm", 7)
    assert ran.exit_code == 0, ran.output
    second = open_orthoscopic(tmp_path / "out/orthoscopic/0002.exr")
    assert (second.pitch_mm, second.focal_length_mm) == (2, 7)
    assert np.array_equal(second.pixels, (_sheet() * 0.5).astype(np.float16))


def test_a_master_of_ours_says_all_itself(tmp_path: Path) -> None:
    (tmp_path / "integral").mkdir()
    rig = Rig(lens_array=LensArray(count=(6, 7), pitch_mm=1.5), px_per_lens=8)
    sheet = _sheet()
    write_exr(tmp_path / "integral/0001.exr", sheet, attributes={"rig": rig.model_dump_json()})
    ran = _run(tmp_path / "integral/0001.exr", "--out", tmp_path / "out")
    assert ran.exit_code == 0, ran.output
    assert np.array_equal(open_orthoscopic(tmp_path / "out/orthoscopic/0001.exr").pixels, orthoscopic(sheet, LAYOUT))


def test_a_hexagonal_row_that_would_come_out_shifted_is_left_out_and_said(tmp_path: Path) -> None:
    layout = CellLayout(5, 4, 8, "hexagonal", first_row_shifted=True)
    file = _exr(tmp_path / "a.exr", _sheet(layout))
    options = ("--pitch-px", 8, "--row-pitch-px", 7, "--lattice", "hexagonal", "--first-row-shifted")
    ran = _run(file, *options, "--first-lens-px", "8,5.5", "--lenses", "4x5", "--out", tmp_path / "out")
    assert ran.exit_code == 0, ran.output
    assert "The first lens row is left out" in ran.output
    assert open_orthoscopic(tmp_path / "out/orthoscopic/0001.exr").layout == CellLayout(4, 4, 8, "hexagonal")


def test_lenses_are_found_from_white_and_a_wrong_pitch_is_put_right(tmp_path: Path) -> None:
    grid = LensGrid(1, 1, pitch_px=13.7, offset_px=(9.1, 4.4), turn_deg=1.2)
    white = white_image(grid, (220, 260), noise=0.01)
    Image.fromarray((np.clip(white[..., 0], 0, 1) * 65535).astype(np.uint16)).save(tmp_path / "white.png")
    Image.fromarray(np.zeros((220, 260, 3), np.uint8)).save(tmp_path / "dark.png")
    words = (tmp_path / "dark.png", "--find-from", tmp_path / "white.png", "--out", tmp_path / "out")
    ran = _run(*words, "--json")
    assert ran.exit_code == 0, ran.output
    told = json.loads(ran.stdout.splitlines()[-1])
    assert told["known_by"] == "white"
    assert told["geometry"]["pitch_px"] == pytest.approx(13.7, rel=2e-4)
    assert told["geometry"]["rotation_deg"] == pytest.approx(1.2, abs=0.01)
    wrong = _run(*words, "--pitch-px", 13)
    assert isinstance(wrong.exception, Exception)
    assert "expected --pitch-px 13.70" in str(wrong.exception)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "expected --pitch-px, or --find, or --find-from"),
        (("--pitch-px", 8, "--lenses", "8x6"), "has room for 7 x 6, or as many with a pitch of 7.00 px"),
        (("--pitch-px", 1), "pitch_px: expected a number of at least 2, got 1.0"),
        (("--pitch-px", 8, "--first-lens-px", "1"), "expected --first-lens-px as RIGHT,DOWN"),
        (("--find",), "give the pitch"),
    ],
)
def test_what_cannot_be_is_said(tmp_path: Path, options: tuple[object, ...], said: str) -> None:
    ran = _run(_exr(tmp_path / "a.exr", _sheet()), "--out", tmp_path / "out", *options)
    assert ran.exit_code != 0
    assert said in str(ran.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("options", "light", "noted"),
    [((), ((0x80 / 255 + 0.055) / 1.055) ** 2.4, True), (("--linear",), 0x80 / 255, False)],
    ids=["as sRGB", "--linear"],
)
def test_a_png_without_a_colour_space_is_srgb_with_a_note_unless_it_is_said_to_be_linear(
    tmp_path: Path, options: tuple[str, ...], light: float, noted: bool
) -> None:
    path, bundle = tmp_path / "a.png", tmp_path / "bundle"
    Image.new("RGB", (LAYOUT.cols, LAYOUT.rows), (0x80,) * 3).save(path)
    ran = _run(path, "--pitch-px", 8, "--out", tmp_path / "out", "--bundle", bundle, *options)
    assert ran.exit_code == 0, ran.output
    np.testing.assert_allclose(open_orthoscopic(tmp_path / "out/orthoscopic/0001.exr").pixels, light, atol=5e-4)
    assert ("a.png: no colour space is named, so the codes are read as sRGB" in ran.stderr) == noted
    sheets = tomllib.loads((bundle / "scene.toml").read_text())["sheets"]
    assert sheets.get("linear", False) != noted
