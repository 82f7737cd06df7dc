"""`lippmann compare`: files, folders and lenses found; numbers in a table and as JSON; what does not fit is named."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from lippmann.cli import main
from lippmann.job.optics.rig import Rig
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.quality.compare import compare, compare_views
from lippmann.lightfield.views.views import view
from lippmann.plan.sampling import display_size
from worker.images.colour import srgb_codes
from worker.images.write import write_exr, write_png

SQUARE = Rig.model_validate({"lens_array": {"count": [12, 13]}, "px_per_lens": 4})
HEXAGONAL = Rig.model_validate({"lens_array": {"count": [13, 12], "lattice": "hexagonal"}, "px_per_lens": 4})
LENSES = ("--px-per-lens", "4", "--lenses", "13x12")

Light = NDArray[np.float32]


def light(layout: CellLayout, *, noise: float = 0.0, seed: int = 1) -> Light:
    random = np.random.default_rng(seed)
    row, col = np.mgrid[: layout.rows, : layout.cols]
    smooth = (0.5 + 0.3 * np.sin(row / 9) * np.cos(col / 7))[..., np.newaxis] * np.array([1.0, 0.8, 0.6])
    noisy: Light = (smooth + noise * random.standard_normal(smooth.shape)).astype(np.float32)
    return noisy


def master(path: Path, rig: Rig = SQUARE, *, noise: float = 0.0) -> Light:
    path.parent.mkdir(parents=True, exist_ok=True)
    picture = light(display_size(rig), noise=noise)
    write_exr(path, picture, attributes={"rig": rig.model_dump_json()})
    return picture.astype(np.float16)


def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, str]:
    monkeypatch.setattr(sys, "argv", ["lippmann", "compare", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main.main()
    said = capsys.readouterr()
    return int(ended.value.code or 0), said.out or " ".join(said.err.split())


@pytest.fixture
def ask(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Any:
    monkeypatch.chdir(tmp_path)

    def asked(*arguments: object) -> Any:
        code, said = run(monkeypatch, capsys, *arguments, "--json")
        assert code == 0, said
        return json.loads(said)

    return asked


@pytest.fixture
def refused(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Any:
    monkeypatch.chdir(tmp_path)

    def said(*arguments: object) -> str:
        code, words = run(monkeypatch, capsys, *arguments)
        assert code == 2, words
        return words

    return said


@pytest.mark.parametrize("rig", [SQUARE, HEXAGONAL], ids=["square", "hexagonal"])
def test_two_masters_are_compared_as_srgb_codes_sheet_and_views(ask: Any, rig: Rig) -> None:
    first, second = srgb_codes(master(Path("a.exr"), rig)), srgb_codes(master(Path("b.exr"), rig, noise=0.02))
    layout = display_size(rig)
    (frame,) = ask("a.exr", "b.exr")["frames"]
    sheet, every = compare(first, second), compare_views(first, second, layout)
    assert frame["sheet"] == pytest.approx(
        {"psnr_y_db": sheet.psnr_y_db, "psnr_rgb_db": sheet.psnr_rgb_db, "ssim": sheet.ssim}, abs=1e-6
    )
    assert frame["view_exists"] == layout.mask.tolist()
    for name in ("psnr_y_db", "psnr_rgb_db", "ssim"):
        said, values = frame["views"][name], getattr(every, name)
        shown = np.array(said["each"], dtype=np.float64)
        np.testing.assert_allclose(shown, values, atol=1e-6)
        u, v = said["worst"]["u"], said["worst"]["v"]
        assert said["minimum"] == pytest.approx(np.nanmin(values), abs=1e-6) == pytest.approx(values[v, u], abs=1e-6)
        assert said["mean"] == pytest.approx(np.nanmean(values), abs=1e-6)
        assert said["deviation"] == pytest.approx(np.nanstd(values), abs=1e-6)


def test_a_picture_and_itself_have_no_finite_psnr_and_an_ssim_of_1(ask: Any) -> None:
    master(Path("a.exr"))
    said = ask("a.exr", "a.exr")
    assert said["mean"]["sheet"] == said["mean"]["views"] == {"psnr_y_db": None, "psnr_rgb_db": None, "ssim": 1.0}
    assert said["frames"][0]["views"]["psnr_rgb_db"]["infinite"] == 16


def test_a_png_is_compared_by_the_lenses_of_the_master_or_those_that_are_said(ask: Any) -> None:
    master(Path("a.exr"))
    write_png(Path("b.png"), light(display_size(SQUARE), noise=0.02))
    write_png(Path("a.png"), light(display_size(SQUARE)).astype(np.float16))
    by_header, by_word = ask("a.exr", "b.png")["frames"], ask("a.png", "b.png", *LENSES)["frames"]
    assert by_header[0]["views"] == by_word[0]["views"]
    assert by_header[0]["lenses"] == {"count": [12, 13], "px_per_lens": 4, "lattice": "square"}


def test_frames_of_two_folders_are_paired_by_name_and_averaged(ask: Any) -> None:
    for number, noise in ((1, 0.01), (2, 0.05)):
        master(Path(f"a/orthoscopic/{number:04d}.exr"))
        master(Path(f"b/{number:04d}.exr"), noise=noise)
    Path("a/orthoscopic/0001.png").write_bytes(b"a master goes before")
    said = ask("a", "b")
    assert [(frame["name"], frame["a"]) for frame in said["frames"]] == [
        ("0001", "a/orthoscopic/0001.exr"),
        ("0002", "a/orthoscopic/0002.exr"),
    ]
    sheets = [frame["sheet"] for frame in said["frames"]]
    views = [{name: over["mean"] for name, over in frame["views"].items()} for frame in said["frames"]]
    for mean, (one, two) in ((said["mean"]["sheet"], sheets), (said["mean"]["views"], views)):
        assert mean == pytest.approx({name: (one[name] + two[name]) / 2 for name in one}, abs=1e-5)


def test_the_table_names_the_worst_view(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    layout, first, second = display_size(SQUARE), tmp_path / "a.exr", tmp_path / "b.exr"
    picture = master(first).copy()
    view(picture, layout, 3, 1)[::2] *= 0.8
    write_exr(second, picture, attributes={})
    code, said = run(monkeypatch, capsys, first, second)
    lines = said.splitlines()
    assert code == 0
    assert lines[0] == "13 x 12 lenses of 4 px, 16 views"
    assert lines[2].split("  ")[-1].strip() == "SSIM"
    assert [line.split("  ")[0] for line in lines[3:6]] == ["whole sheet", "views, mean", "views, standard deviation"]
    assert lines[7].split("  ")[-1] == "(3, 1)"
    assert lines[8].startswith("identical views: 15;")


def test_a_table_of_frames_ends_with_their_mean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for number in (1, 2):
        master(tmp_path / f"a/{number:04d}.exr")
        master(tmp_path / f"b/{number:04d}.exr", noise=0.02)
    _, said = run(monkeypatch, capsys, tmp_path / "a", tmp_path / "b")
    assert [line.split(" ")[0] for line in said.splitlines()[2:]] == ["FRAME", "0001", "0002", "mean"]


def test_what_is_not_there_is_named(refused: Any) -> None:
    master(Path("a.exr"))
    assert "which is not there" in refused("a.exr", "b.exr")
    assert "got the folder . and the picture a.exr" in refused("a.exr", ".")
    Path("empty").mkdir()
    assert "expected frames as EXR or PNG in empty, got none" in refused("empty", ".")


def test_frames_that_are_missing_are_named_with_their_folder(refused: Any) -> None:
    for name in ("a/0001", "a/0002", "a/0003", "b/0002", "b/0004"):
        master(Path(f"{name}.exr"))
    said = refused("a", "b")
    assert "expected the same frames twice, got no 0001, 0003 in b and no 0004 in a" in said


def test_sizes_that_differ_are_named(refused: Any) -> None:
    master(Path("a.exr"))
    write_png(Path("b.png"), light(CellLayout(12, 12, 4)))
    assert "a.exr and b.png: expected the same size twice, got 52 x 48 px and 48 x 48 px" in refused("a.exr", "b.png")


def test_lenses_that_nobody_says_or_that_do_not_fit_are_named(refused: Any) -> None:
    master(Path("a.exr"))
    picture = light(display_size(SQUARE))
    write_png(Path("a.png"), picture)
    write_exr(Path("bare.exr"), picture, attributes={})
    for name in ("a.png", "bare.exr"):
        assert "expected --px-per-lens and --lenses, or a master (EXR)" in refused(name, name)
    assert "or neither, got only --px-per-lens" in refused("a.png", "a.png", "--px-per-lens", 4)
    assert "at least one lens" in refused("a.png", "a.png", "--px-per-lens", 4, "--lenses", "13x0")
    said = refused("a.png", "a.png", "--px-per-lens", 4, "--lenses", "12x13")
    assert "52 x 48 px do not divide among 12 x 13 lenses of 4 px" in said
    said = refused("a.exr", "a.png", "--px-per-lens", 2, "--lenses", "26x24")
    assert "13 x 12 lenses of 4 px by a.exr; 26 x 24 lenses of 2 px by --px-per-lens and --lenses" in said


def test_masters_of_other_lenses_are_refused(refused: Any) -> None:
    master(Path("a.exr"))
    master(Path("b.exr"), HEXAGONAL)
    assert "expected the same lenses over both, got 13 x 12 lenses" in refused("a.exr", "b.exr")
    write_exr(Path("c.exr"), light(display_size(SQUARE)), attributes={"rig": '{"px_per_lens": 1}'})
    assert "c.exr: the rig in the header" in refused("a.exr", "c.exr")


@pytest.mark.parametrize("folder", ["integral", "views", "device"])
def test_masters_of_the_same_size_that_show_something_else_are_refused(refused: Any, folder: str) -> None:
    master(Path(f"{folder}/0001.exr"))
    assert "expected an orthoscopic integral image, as orthoscopic/0001.exr" in refused(
        f"{folder}/0001.exr", f"{folder}/0001.exr"
    )


def test_pictures_that_are_none_are_named(refused: Any) -> None:
    master(Path("a.exr"))
    Path("b.jpg").write_bytes(b"")
    assert "expected an EXR or a PNG, got b.jpg" in refused("a.exr", "b.jpg")
    for name in ("cut.exr", "words.png"):
        Path(name).write_bytes(Path("a.exr").read_bytes()[:900] if name == "cut.exr" else b"words")
        assert f"expected a whole picture at {name}" in refused("a.exr", name)


def test_a_png_in_another_colour_space_is_compared_by_its_light(ask: Any, tmp_path: Path) -> None:
    picture = master(tmp_path / "a.exr").astype(np.float32)
    # Pillow cannot write 16 bits of three channels, so the light is rounded to 8 bits.
    codes = np.rint(np.clip(picture, 0, 1) * 255).astype(np.uint8)
    gamma = PngInfo()
    gamma.add(b"gAMA", (100_000).to_bytes(4, "big"))
    Image.fromarray(codes).save(tmp_path / "linear.png", pnginfo=gamma)
    Image.fromarray(codes).save(tmp_path / "unnamed.png")
    psnr = {
        words: ask("a.exr", *words)["mean"]["sheet"]["psnr_y_db"]
        for words in (("linear.png",), ("unnamed.png",), ("unnamed.png", "--linear"))
    }
    assert psnr["linear.png",] > 45
    assert psnr["unnamed.png",] < 20
    assert psnr["unnamed.png", "--linear"] == psnr["linear.png",]


def test_a_png_without_a_colour_space_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    picture = master(tmp_path / "a.exr")
    Image.fromarray(srgb_codes(picture)).save("unnamed.png")
    write_png(tmp_path / "ours.png", picture.astype(np.float32))
    for name, noted in (("unnamed.png", True), ("ours.png", False)):
        monkeypatch.setattr(sys, "argv", ["lippmann", "compare", "a.exr", name])
        with pytest.raises(SystemExit):
            main.main()
        err = " ".join(capsys.readouterr().err.split())
        assert ("unnamed.png: no colour space is named" in err) == noted
