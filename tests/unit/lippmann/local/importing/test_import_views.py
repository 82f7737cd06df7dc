"""Views as integral images: back from our own exports, and from names of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

from lippmann.cli.main import app
from lippmann.errors import BadInput
from lippmann.job.optics.rig import LensArray, Rig
from lippmann.lattice.layout import CellLayout
from lippmann.local.files.frame_source import files_frames
from lippmann.local.files.source_pictures import Decoding, SourcePicture
from lippmann.local.image import IntegralImage, open_orthoscopic
from lippmann.local.importing.import_views import Views, ViewsOptions, import_views
from lippmann.local.pictures.export import export_outputs, parse_outputs
from worker.images.colour import srgb_codes
from worker.images.write import write_exr

COUNT = (6, 9)
N = 5
RNG = np.random.default_rng(2)
LIGHT = RNG.random((COUNT[0] * N, COUNT[1] * N, 3)).astype(np.float16)


@pytest.fixture
def master(tmp_path: Path) -> Path:
    rig = Rig(imaging_lens=None, lens_array=LensArray(count=COUNT, offset_mm=0.0), px_per_lens=N)
    path = tmp_path / "ours/orthoscopic/0001.exr"
    path.parent.mkdir(parents=True)
    write_exr(path, LIGHT, attributes={"rig": rig.model_dump_json(), "frame": "1"})
    return path


def _export(master: Path, written: str, out: Path) -> Path:
    """Return the one file of an export, or its folder."""
    source = files_frames(master.parent.parent, fps=8.0)
    (made,) = export_outputs(source, parse_outputs([written], source), out)
    assert made.error is None
    files = made.files[1:]
    return files[0] if len(files) == 1 else files[0].parent


def _import(*words: object) -> Any:
    ran = CliRunner().invoke(app, ["import", *map(str, words)])
    assert ran.exit_code == 0, f"{ran.output} {ran.exception}"
    return ran


def _views(path: Path) -> np.ndarray[Any, Any]:
    """Return the sRGB codes of all views of a master, `(v, u, lens_row, lens_col, 3)`."""
    views = open_orthoscopic(path).views()
    codes = srgb_codes(np.asarray(views).reshape(-1, *views.shape[3:]), bits=16)
    return np.asarray(codes).reshape(views.shape).astype(int)


@pytest.mark.parametrize(
    ("written", "parallax", "off"),
    [
        ('{"kind": "quilt", "views": "all", "bits": 16}', "grid", 1),
        ('{"kind": "quilt", "views": "all"}', "grid", 129),
        ('{"kind": "hci", "disparity": "none"}', "grid", 129),
        ("subaperture_ppm", "grid", 33),
    ],
)
def test_our_own_exports_come_back_as_the_same_image(
    tmp_path: Path, master: Path, written: str, parallax: str, off: int
) -> None:
    source = _export(master, written, tmp_path / "made")
    _import(source, "--views", parallax, "--out", tmp_path / "back")
    back = tmp_path / "back/orthoscopic/0001.exr"
    assert open_orthoscopic(back).layout == CellLayout(*COUNT, N)
    # Half a step of the codes of the export, in codes of 16 bits, and what half floats round.
    assert np.abs(_views(back) - _views(master)).max() <= off + 16


def test_a_quilt_of_one_row_gives_these_views_in_every_row(tmp_path: Path, master: Path) -> None:
    quilt = _export(master, '{"kind": "quilt", "bits": 16}', tmp_path / "made")
    _import(quilt, "--views", "row", "--out", tmp_path / "back")
    back, ours = _views(tmp_path / "back/orthoscopic/0001.exr"), _views(master)
    for v in range(N):
        assert np.abs(back[v] - ours[N // 2]).max() <= 17
    again = _export(tmp_path / "back/orthoscopic/0001.exr", '{"kind": "quilt", "bits": 16}', tmp_path / "again")
    assert again.name == quilt.name
    with Image.open(again) as second, Image.open(quilt) as first:
        assert np.abs(np.asarray(second).astype(int) - np.asarray(first).astype(int)).max() <= 1


def test_fewer_views_are_taken_evenly_from_the_first_to_the_last(tmp_path: Path, master: Path) -> None:
    quilt = _export(master, '{"kind": "quilt", "views": "all"}', tmp_path / "made")
    _import(quilt, "--views", "grid", "--px-per-lens", 3, "--out", tmp_path / "back")
    assert np.abs(_views(tmp_path / "back/orthoscopic/0001.exr") - _views(master)[::2, ::2]).max() <= 145


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("out_{v:02d}_{u:02d}_-381.9_776.3_.png", ()),
        ("{u:03d}_{v:03d}.png", ()),
        ("{v:03d}_{u:03d}.png", ("--view-names", "row_column")),
        ("IMG_0012_{v:02d}_{u:02d}.png", ()),
        ("view_c{u}_r{v}.png", ()),
        ("input_Cam{number:03d}.png", ()),
    ],
)
def test_names_of_views_of_other_programs_are_understood(tmp_path: Path, name: str, words: tuple[str, ...]) -> None:
    codes = RNG.integers(0, 256, (4, 4, 6, 7, 3), dtype=np.uint8)
    (tmp_path / "views").mkdir()
    for v, u in np.ndindex(4, 4):
        Image.fromarray(codes[v, u]).save(tmp_path / "views" / name.format(u=u, v=v, number=4 * v + u))
    _import(tmp_path / "views", "--views", "grid", *words, "--out", tmp_path / "out")
    image = IntegralImage.open(tmp_path / "out/orthoscopic/0001.exr")
    for v, u in np.ndindex(4, 4):
        assert np.array_equal(srgb_codes(np.asarray(image.view(u, v), dtype=np.float32)), codes[v, u])


def test_views_become_a_bundle_of_their_integral_image(tmp_path: Path, master: Path) -> None:
    quilt = _export(master, '{"kind": "quilt", "views": "all"}', tmp_path / "made")
    _import(quilt, "--views", "grid", "--out", tmp_path / "out", "--bundle", tmp_path / "bundle")
    made = IntegralImage.open(tmp_path / "out/orthoscopic/0001.exr").pixels
    packed = IntegralImage.open(tmp_path / "bundle/frames/0001.exr").pixels
    assert np.array_equal(made, packed)


@pytest.mark.parametrize(
    ("files", "words", "said"),
    [
        (("a.png",), (), "named as input_Cam000.png, 000_000.ppm, out_00_00.png or r00_c00.png, got a.png"),
        ((), (), "got no picture"),
        (("000_000.png", "001_001.png"), (), "expected 2 x 2 views (columns x rows)"),
        (("input_Cam000.png", "input_Cam002.png"), (), "expected as many rows of views as columns"),
        (("input_Cam000.png",), (), "expected at least 2 views in a row, got 1"),
        (("000_000.png",), ("--find",), "expected no --find"),
        (("000_000.png",), ("--lenses", "4x3"), "expected no --lenses with --views"),
    ],
)
def test_views_that_cannot_be_are_refused(
    tmp_path: Path, files: tuple[str, ...], words: tuple[object, ...], said: str
) -> None:
    (tmp_path / "views").mkdir()
    for name in files:
        Image.new("RGB", (4, 4)).save(tmp_path / "views" / name)
    words = (tmp_path / "views", "--views", "grid", "--out", tmp_path / "out", *words)
    ran = CliRunner().invoke(app, ["import", *map(str, words)])
    assert ran.exit_code != 0
    assert said in str(ran.exception)
    assert not (tmp_path / "out").exists()


def test_names_that_do_not_say_which_number_is_the_row_have_a_note(tmp_path: Path) -> None:
    for v, u in np.ndindex(2, 2):
        Image.new("L", (4, 4)).save(tmp_path / f"{u}_{v}.png")
    ran = _import(tmp_path, "--views", "grid", "--out", tmp_path / "out")
    assert "the first number of the view is taken for the column" in ran.stderr
    assert "give --view-names row_column" in ran.stderr
    ran = _import(tmp_path, "--views", "grid", "--view-names", "row_column", "--out", tmp_path / "out")
    assert "--view-names" not in ran.stderr


@pytest.mark.parametrize(
    ("sizes", "limit_px", "said"),
    [
        (((9, 8),) * 4, 200, "at most 200 px, got 288 px of 2 x 2 views of 9 x 8 px"),
        (((9, 8),) * 4, 60, r"expected at most 60 px, got 8 x 9 px, which is 72"),
        (((9, 8), (9, 8), (9, 8), (8, 9)), 10_000, r"expected views of 9 x 8 px in .*, got 8 x 9 px in .*1_1\.png"),
        (((5000, 2),) * 4, 1 << 20, r"views: count\..*: expected .*4096.*, got 5000"),
    ],
)
def test_views_are_refused_by_their_headers_before_one_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sizes: tuple[tuple[int, int], ...], limit_px: int, said: str
) -> None:
    (tmp_path / "views").mkdir()
    for (v, u), size in zip(np.ndindex(2, 2), sizes, strict=True):
        Image.new("L", size).save(tmp_path / f"views/{u}_{v}.png")
    monkeypatch.setenv("LIPPMANN_PICTURE_PX", str(limit_px))
    monkeypatch.setattr("lippmann.local.importing.import_views.read_picture", pytest.fail)
    with pytest.raises(BadInput, match=said):
        import_views([tmp_path / "views"], ViewsOptions("grid"), out=tmp_path / "out")


def test_a_later_frame_of_another_size_is_refused_before_the_first_is_decoded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number, size in enumerate([(12, 12), (12, 18)]):
        Image.new("L", size).save(tmp_path / f"{number}_qs3x2.png")
    monkeypatch.setattr("lippmann.local.importing.import_views.read_picture", pytest.fail)
    quilts = [tmp_path / "0_qs3x2.png", tmp_path / "1_qs3x2.png"]
    with pytest.raises(BadInput, match=r"expected 6 x 6 views of 4 x 6 px as in .*0_qs.*, got 6 x 6 views of 4 x 9 px"):
        import_views(quilts, ViewsOptions("row"), out=tmp_path / "out")


def test_only_the_views_that_are_used_are_decoded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(9):
        Image.new("L", (4, 4)).save(tmp_path / f"{number}.png")
    read: list[str] = []

    def read_picture(source: SourcePicture, _: Decoding) -> Views:
        read.append(source.name)
        return np.zeros((4, 4, 3), np.float32)

    monkeypatch.setattr("lippmann.local.importing.import_views.read_picture", read_picture)
    options = ViewsOptions("row", px_per_lens=3, pseudoscopic=True)
    import_views([tmp_path], options, out=tmp_path / "out")
    assert read == ["8.png", "4.png", "0.png"]


@pytest.mark.parametrize(
    ("name", "size", "said"),
    [
        ("a.png", (12, 12), "whose name ends like _qs8x6a0.75"),
        ("a_qs0x6a1.png", (12, 12), "whose name ends like _qs8x6a0.75"),
        ("a_qs5x2a1.png", (12, 12), "expected a quilt that 5 x 2 tiles"),
        ("a_qs100x99a1.png", (3200, 3168), "give --px-per-lens"),
    ],
)
def test_a_quilt_that_cannot_be_is_refused(tmp_path: Path, name: str, size: tuple[int, int], said: str) -> None:
    Image.new("RGB", size).save(tmp_path / name)
    words = (tmp_path / name, "--views", "row", "--out", tmp_path / "out")
    ran = CliRunner().invoke(app, ["import", *map(str, words)])
    assert ran.exit_code != 0
    assert said in str(ran.exception)
