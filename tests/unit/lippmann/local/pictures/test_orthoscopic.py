"""`lippmann orthoscopic`: masters and pictures from elsewhere, by half-turn and by SPOC; what cannot be is named."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from lippmann.cli import main
from lippmann.job.optics.rig import Rig
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells, orthoscopic, turn_sheet
from lippmann.local.image import open_orthoscopic
from lippmann.local.pictures import orthoscopic as conversion
from lippmann.plan.sampling import display_size, frame_size
from tests.pictures import read_png, read_tiff
from tests.unit.lippmann.lightfield.sheets import numbered_sheet
from worker.images.bands import rows
from worker.images.colour import linear_light, srgb_codes
from worker.images.read import read_attributes, read_rgb
from worker.images.write import write_code_rows, write_exr

COUNT = (5, 4)
LATTICES = pytest.mark.parametrize("lattice", ["square", "hexagonal"])

ORTHOSCOPIC = {"kind": "orthoscopic"}
"""What a converted image adds to its header."""


def rig_of(lattice: str = "square", **more: Any) -> Rig:
    return Rig.model_validate({"px_per_lens": 8, "lens_array": {"count": COUNT, "lattice": lattice}, **more})


def captured(folder: Path, rig: Rig) -> tuple[Path, np.ndarray]:
    layout = frame_size(rig)
    light = (numbered_sheet(layout) % 2048 / 2048).astype(np.float16)
    path = folder / "integral" / "0001.exr"
    path.parent.mkdir(parents=True)
    write_exr(path, light, attributes={"rig": rig.model_dump_json(), "job": "j"})
    return path, light


def picture_of(path: Path, layout: CellLayout, bits: int = 8) -> np.ndarray:
    codes: np.ndarray = (numbered_sheet(layout) % 2**bits).astype(f"u{bits // 8}")
    write_code_rows(path, (codes,), size=codes.shape[:2], bits=bits)
    return codes


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(*arguments: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> tuple[Any, str, str]:
    monkeypatch.setattr(sys, "argv", ["lippmann", "orthoscopic", *arguments])
    with pytest.raises(SystemExit) as ended:
        main.main()
    said = capsys.readouterr()
    return ended.value.code, said.out, " ".join(said.err.split())


def made(*arguments: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    code, out, err = run(*arguments, "--json", monkeypatch=monkeypatch, capsys=capsys)
    assert not code, err
    return json.loads(out)


@LATTICES
@pytest.mark.parametrize("imaging_lens", ["athineos-2006", None])
@pytest.mark.parametrize("band_px", [1, 10**6])
def test_a_capture_becomes_the_jobs_own_orthoscopic_master(
    lattice: str, imaging_lens: str | None, band_px: int, here: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.setattr(conversion, "BAND_PX", band_px)
    rig = rig_of(lattice, imaging_lens=imaging_lens)
    path, light = captured(here, rig)
    said = made(str(path), "--out", "new/shown.exr", monkeypatch=monkeypatch, capsys=capsys)
    inverted = imaging_lens is not None
    assert (said["method"], said["sheet_turned"]) == ("half-turn", inverted)
    found = open_orthoscopic(here / "new/shown.exr")
    np.testing.assert_array_equal(found.pixels, orthoscopic(light, frame_size(rig), inverted=inverted))
    assert found.layout == display_size(rig)
    assert read_attributes(here / "new/shown.exr") == read_attributes(path) | ORTHOSCOPIC
    assert said["lenses"]["first_row_shifted"] == found.layout.first_row_shifted


@LATTICES
@pytest.mark.parametrize("turn", [True, False])
@pytest.mark.parametrize(("suffix", "bits"), [("png", 8), ("png", 16), ("tif", 8), ("tif", 16)])
def test_codes_from_elsewhere_stay_as_they_are(
    lattice: Lattice, turn: bool, suffix: str, bits: int, here: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    # In small bands, read backward if the sheet is turned.
    monkeypatch.setattr(conversion, "BAND_PX", 100)
    monkeypatch.setattr(rows, "BAND_BYTES", 1000)
    layout = CellLayout(*COUNT, px_per_lens=8, lattice=lattice)
    codes = picture_of(here / f"a.{suffix}", layout, bits)
    said = ["--px-per-lens", "8", "--lenses", "4x5", "--lattice", lattice, *["--turn-sheet"] * turn]
    made(f"a.{suffix}", "--out", "b.tif", *said, monkeypatch=monkeypatch, capsys=capsys)
    expected = turn_sheet(half_turn_cells(codes, layout)) if turn else half_turn_cells(codes, layout)
    np.testing.assert_array_equal(read_tiff("b.tif"), expected)
    assert sorted(path.name for path in here.iterdir()) == [f"a.{suffix}", "b.tif"]


def test_light_becomes_codes_and_codes_light(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, light = captured(here, rig_of())
    upright = orthoscopic(light, frame_size(rig_of()))
    made(str(path), "--out", "a.png", monkeypatch=monkeypatch, capsys=capsys)
    np.testing.assert_array_equal(read_png(here / "a.png"), srgb_codes(upright))
    made(str(path), "--out", "a.tif", "--bits", "16", monkeypatch=monkeypatch, capsys=capsys)
    np.testing.assert_array_equal(read_tiff("a.tif"), srgb_codes(upright, bits=16))
    said = ["--px-per-lens", "8", "--lenses", "4x5"]
    made("a.png", "--out", "b.exr", *said, monkeypatch=monkeypatch, capsys=capsys)
    turned = half_turn_cells(linear_light(srgb_codes(upright)), frame_size(rig_of()))
    np.testing.assert_array_equal(read_rgb(here / "b.exr", np.float16), turned)
    assert read_attributes(here / "b.exr") == ORTHOSCOPIC


def test_a_sheet_turned_otherwise_than_its_header_says_names_no_rig_that_is_not_its(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, light = captured(here, rig_of("hexagonal"))
    said = made(str(path), "--keep-sheet", "--out", "a.exr", monkeypatch=monkeypatch, capsys=capsys)
    assert not said["sheet_turned"]
    np.testing.assert_array_equal(
        read_rgb(here / "a.exr", np.float16), half_turn_cells(light, frame_size(rig_of("hexagonal")))
    )
    assert read_attributes(here / "a.exr") == {"job": "j"} | ORTHOSCOPIC


def test_floats_in_a_tiff_are_linear_light(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    layout = frame_size(rig_of())
    light = (numbered_sheet(layout) % 2048 / 2048).astype(np.float32)
    tifffile.imwrite("a.tif", light, photometric="rgb")
    made("a.tif", "--out", "a.exr", *lenses_of(8), monkeypatch=monkeypatch, capsys=capsys)
    np.testing.assert_array_equal(read_rgb(here / "a.exr", np.float32), half_turn_cells(light, layout))


@LATTICES
def test_for_the_captures_own_display_spoc_is_the_half_turn(
    lattice: str, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, _ = captured(here, rig_of(lattice))
    made(str(path), "--out", "half.exr", monkeypatch=monkeypatch, capsys=capsys)
    said = made(str(path), "--out", "spoc.exr", "--distance-mm", "0", monkeypatch=monkeypatch, capsys=capsys)
    assert said["method"] == "spoc"
    np.testing.assert_array_equal(read_rgb(here / "spoc.exr", np.float16), read_rgb(here / "half.exr", np.float16))


def test_the_header_names_the_new_display(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path, _ = captured(here, rig_of())
    display = ["--display-pitch-mm", "0.5", "--display-px-per-lens", "4", "--display-lattice", "hexagonal"]
    said = made(
        str(path), "--out", "a.exr", *display, "--display-gap-mm", "2", monkeypatch=monkeypatch, capsys=capsys
    )  # fmt: skip
    found = open_orthoscopic(here / "a.exr")
    assert (found.pitch_mm, found.focal_length_mm) == (0.5, 2.0)
    assert said["lenses"]["count"] == [found.layout.lens_rows, found.layout.lens_cols] == [12, 8]
    assert said["size_px"] == list(found.pixels.shape[:2])
    # A sheet from elsewhere has one too, if its lengths are said.
    picture_of(here / "p.png", frame_size(rig_of()))
    lenses = ["--px-per-lens", "8", "--lenses", "4x5", "--pitch-mm", "1", "--gap-mm", "3.3"]
    made("p.png", "--out", "b.exr", *lenses, monkeypatch=monkeypatch, capsys=capsys)
    assert open_orthoscopic(here / "b.exr").focal_length_mm == 3.3
    made("p.png", "--out", "c.exr", *lenses, *display, "--reference-mm", "9", monkeypatch=monkeypatch, capsys=capsys)
    assert open_orthoscopic(here / "c.exr").pitch_mm == 0.5


NO_LENS = "expected at least one lens of at least one px"


def lenses_of(px_per_lens: int) -> list[str]:
    return ["--px-per-lens", str(px_per_lens), "--lenses", "4x5"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["none.exr"], "expected a pseudoscopic integral image, got none.exr: there is no such file"),
        (["a.gif"], "expected an EXR, a PNG or a TIFF as FILE, got a.gif"),
        (["p.png", *lenses_of(8), "--out", "b.jpg"], "expected an EXR, a PNG or a TIFF as --out, got b.jpg"),
        (["p.png"], "expected --px-per-lens and --lenses, or a master (EXR) whose header names its rig"),
        (["p.png", "--px-per-lens", "8"], "or neither, got only --px-per-lens"),
        (["p.png", "--lattice", "square"], "or neither, got only --lattice"),
        (["p.png", "--lattice", "round"], "--lattice: expected one of square, hexagonal, got 'round'"),
        (["p.png", *lenses_of(0)], NO_LENS),
        (["p.png", "--px-per-lens", "8", "--lenses", "4x0"], NO_LENS),
        (["p.png", *lenses_of(7)], "32 x 40 px do not divide among 4 x 5 lenses of 7 px"),
        (["MASTER", *lenses_of(4)], "that the header of MASTER names, 4 x 5 lenses of 8"),
        (["MASTER", "--pitch-mm", "1"], "expected no --pitch-mm: the header names pitch and focal length"),
        (["MASTER", "--out", "MASTER"], "expected another file in --out than the sheet itself"),
        (["MASTER", "--display-pitch-mm", "-1"], "--display-pitch-mm: expected a number above 0, got -1"),
        (["MASTER", "--display-gap-mm", "nan"], "--display-gap-mm: expected a finite number, got nan"),
        (["MASTER", "--display-px-per-lens", "1"], "--display-px-per-lens: expected a number of at least 2, got 1"),
        (["MASTER", "--display-lenses", "4x0"], "--display-lenses: expected a number of at least 1, got 0"),
        (["MASTER", "--display-lattice", "hexagonal", "--display-px-per-lens", "7"], "px-per-lens: expected an even"),
        (["MASTER", "--reference-mm", "0"], "--reference-mm: expected a depth other than 0"),
        (["MASTER", "--bits", "12"], "--bits: expected one of 8, 16, got '12'"),
        (["MASTER", "--bits", "16"], "expected --bits for codes made of linear light only, got it for out.exr"),
        (["p.png", *lenses_of(8), "--out", "b.png", "--bits", "16"], "expected --bits for codes made of linear light"),
        (["p.png", *lenses_of(8), "--display-gap-mm", "2"], "expected --pitch-mm and --gap-mm of the capture"),
        (["p.png", *lenses_of(8), "--pitch-mm", "0", "--gap-mm", "2"], "a positive number of mm in --pitch-mm, got 0"),
        (["cut.exr"], "expected a whole picture at cut.exr, got cut.exr: "),
        (["cut.png", *lenses_of(8)], "expected a whole picture at cut.png, got cut.png: "),
        (["orthoscopic/0001.exr"], "expected a sheet as captured, as integral/0001.exr, got orthoscopic/0001.exr"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
def test_what_cannot_be_is_named_and_nothing_is_written(
    arguments: list[str], said: str, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    master, _ = captured(here, rig_of())
    (here / "orthoscopic").mkdir()
    (here / "orthoscopic" / "0001.exr").write_bytes(master.read_bytes())
    picture_of(here / "p.png", frame_size(rig_of()))
    for name, whole in (("cut.exr", master), ("cut.png", here / "p.png")):
        data = whole.read_bytes()
        (here / name).write_bytes(data[: len(data) * 9 // 10])
    before = {path: path.read_bytes() for path in here.rglob("*") if path.is_file()}
    words = [str(master) if word == "MASTER" else word for word in arguments]
    out = [] if "--out" in words else ["--out", "out.exr"]
    code, _, err = run(*words, *out, monkeypatch=monkeypatch, capsys=capsys)
    assert code == 2
    assert said.replace("MASTER", str(master)) in err.replace("│ ", "")
    assert {path: path.read_bytes() for path in here.rglob("*") if path.is_file()} == before


def test_what_was_there_stays_when_the_sheet_is_cut_short(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    master, _ = captured(here, rig_of())
    master.write_bytes(master.read_bytes()[:-300])
    (here / "out.exr").write_text("old")
    code, _, _ = run(str(master), "--out", "out.exr", monkeypatch=monkeypatch, capsys=capsys)
    assert code == 2
    assert (here / "out.exr").read_text() == "old"


@pytest.mark.parametrize("suffix", ["png", "tif", "exr"])
def test_codes_of_another_colour_space_become_light_or_srgb(
    suffix: str, here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    layout = CellLayout(3, 4, 4)
    codes = np.random.default_rng(1).integers(0, 256, (layout.rows, layout.cols, 3), dtype=np.uint8)
    gamma = PngInfo()
    gamma.add(b"gAMA", (100_000).to_bytes(4, "big"))
    Image.fromarray(codes).save(here / "linear.png", pnginfo=gamma)
    Image.fromarray(codes).save(here / "unnamed.png")
    expected = half_turn_cells((codes / np.float32(255)).astype(np.float32), layout)
    out = here / f"out.{suffix}"
    for source, options, noted in (("linear.png", (), False), ("unnamed.png", ("--linear",), False)):
        lenses = ("--px-per-lens", "4", "--lenses", "4x3")
        code, _, err = run(source, *lenses, "--out", str(out), *options, monkeypatch=monkeypatch, capsys=capsys)
        assert not code, err
        assert ("no colour space" in err) == noted
        if suffix == "exr":
            np.testing.assert_allclose(read_rgb(out, np.float32), expected, atol=5e-4)
        else:
            np.testing.assert_array_equal(read_png(out), srgb_codes(expected))


def test_codes_without_a_colour_space_are_noted(
    here: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Image.new("RGB", (16, 12)).save(here / "unnamed.png")
    lenses = ("--px-per-lens", "4", "--lenses", "4x3")
    code, _, err = run("unnamed.png", *lenses, "--out", "a.png", monkeypatch=monkeypatch, capsys=capsys)
    assert not code, err
    assert "unnamed.png: no colour space is named" in err
