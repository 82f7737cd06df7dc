"""`lippmann view` and `lippmann refocus`: joined up at a depth, by CIIR, in another size, of a device's pixels."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann.cli import main
from lippmann.errors import BadInput
from lippmann.job.optics.rig import Rig
from lippmann.lightfield.refocus.ciir import ciir
from lippmann.lightfield.refocus.depth_focused_view import depth_focused_view
from lippmann.lightfield.refocus.shift_and_sum import refocus
from lippmann.lightfield.views.views import view
from lippmann.local.files.picture_size import MAX_SIDE_PX, PictureSize
from lippmann.local.image import open_orthoscopic
from lippmann.plan.sampling import display_size
from tests.unit.lippmann.local.masters import master_of, rig_of, said_by
from worker.images.read import read_rgb
from worker.images.resize import resize
from worker.images.write import write_exr, write_png
from worker.tasks.frames.assemble import on_device


@pytest.fixture(params=["square", "hexagonal"])
def rig(request: pytest.FixtureRequest) -> Rig:
    return rig_of(request.param)


@pytest.fixture
def master(rig: Rig, tmp_path: Path) -> Path:
    return master_of(tmp_path, rig)


@pytest.mark.parametrize(
    ("where", "more", "direction", "px"),
    [(["--centre"], [], None, 1), (["--u", "3", "--v", "4"], ["--px-per-lens", "3"], (3, 4), 3)],
    ids=["centre", "view"],
)
def test_view_at_a_depth_is_the_depth_focused_view(
    where: list[str], more: list[str], direction: tuple[int, int] | None, px: int, master: Path, rig: Rig,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    out, expected = tmp_path / "view.png", tmp_path / "expected.png"
    options = [*where, "--depth-mm", "20", *more, "--out", str(out)]
    said = said_by("view", str(master), *options, monkeypatch=monkeypatch, capsys=capsys)
    found = open_orthoscopic(master)
    picture = depth_focused_view(found, 20.0, direction=direction, px_per_lens=px if more else None)
    write_png(expected, picture)
    assert (said["rows"], said["cols"]) == display_size(rig).square_size(px)
    assert out.read_bytes() == expected.read_bytes()


def test_refocus_by_ciir_has_the_sheets_pixels_or_as_many_as_are_asked_for(
    master: Path, rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    found, expected = open_orthoscopic(master), tmp_path / "expected.png"
    for more, px in (([], 8), (["--px-per-lens", "3"], 3)):
        out = tmp_path / "one.png"
        options = ["--depth-mm", "20", "--method", "ciir", *more, "--out", str(out)]
        said = said_by("refocus", str(master), *options, monkeypatch=monkeypatch, capsys=capsys)
        assert said["method"] == "ciir"
        assert read_rgb(out, np.float32).shape[:2] == display_size(rig).square_size(px)
        write_png(expected, ciir(found, 20.0, px_per_lens=px))
        assert out.read_bytes() == expected.read_bytes()


def test_a_stack_by_ciir_is_brightest_at_the_points_depth(
    master: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--stack", "-10:30:10", "--method", "ciir", "--px-per-lens", "2", "--out", str(tmp_path / "stack")]
    said = said_by("refocus", str(master), *options, monkeypatch=monkeypatch, capsys=capsys)
    assert np.argmax([read_rgb(Path(file), np.float32).max() for file in said["files"]]) == 3


@pytest.mark.parametrize(
    ("options", "size"),
    [
        (["--scale", "2.5", "--filter", "mitchell"], {"rows": 53, "cols": 50, "filter_name": "mitchell"}),
        (["--size", "84", "--filter", "box"], {"rows": 84, "cols": 80, "filter_name": "box"}),
        (["--scale", "0.5"], {"rows": 11, "cols": 10, "filter_name": "lanczos3"}),
    ],
    ids=str,
)
def test_a_picture_comes_in_the_size_and_by_the_filter_that_were_asked_for(
    options: list[str], size: dict[str, Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    master = master_of(tmp_path, rig_of())
    found, out, expected = open_orthoscopic(master), tmp_path / "sized.png", tmp_path / "expected.png"
    for command, picture in (
        (["view", str(master), "--centre"], view(found.pixels, found.layout, 4, 4)),
        (["refocus", str(master), "--depth-mm", "20"], refocus(found, 20.0)),
    ):
        said_by(*command, *options, "--out", str(out), monkeypatch=monkeypatch, capsys=capsys)
        assert read_rgb(out, np.float32).shape[:2] == (size["rows"], size["cols"])
        # In linear light, before it is made sRGB.
        write_png(expected, resize(picture, **size))
        assert out.read_bytes() == expected.read_bytes()


@pytest.mark.parametrize("lattice", ["square", "hexagonal"])
def test_views_of_a_master_on_a_devices_pixels_are_those_of_the_orthoscopic_one(
    lattice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    rig = Rig.model_validate({**rig_of(lattice).model_dump(mode="json"), "device": {"dpi": 1200, "margin_px": 7}})
    master = master_of(tmp_path, rig)
    whole = open_orthoscopic(master)
    assert rig.device is not None
    device = tmp_path / "device" / "0001.exr"
    device.parent.mkdir()
    shown = on_device(whole.pixels, whole.layout, rig.device, pitch_mm=1.0)
    write_exr(device, shown, attributes={"rig": rig.model_dump_json()})
    assert shown.shape != whole.pixels.shape
    pictures = []
    for file in (master, device):
        out = str(tmp_path / "view.png")
        said_by("view", str(file), "--u", "4", "--v", "5", "--out", out, monkeypatch=monkeypatch, capsys=capsys)
        pictures.append(read_rgb(Path(out), np.float32))
    # 47.2 px a lens from 8 and back: interpolated twice, which so fine a device hardly shows.
    np.testing.assert_allclose(pictures[1], pictures[0], atol=0.05)


def test_a_device_master_that_is_none_is_refused(tmp_path: Path) -> None:
    master = master_of(tmp_path, rig_of())
    device = master.parent.rename(tmp_path / "device") / master.name
    with pytest.raises(BadInput, match="expected a rig with a device in the header"):
        open_orthoscopic(device)
    rig = Rig.model_validate({**rig_of().model_dump(mode="json"), "device": {"dpi": 300}})
    write_exr(device, np.zeros((8, 8, 3), np.float16), attributes={"rig": rig.model_dump_json()})
    with pytest.raises(BadInput, match=r"expected a master of 236 x 248 px on its device, got 8 x 8"):
        open_orthoscopic(device)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["view", "MASTER", "--centre", "--depth-mm", "0"], "expected a depth at least 3.3 mm from the display"),
        (["view", "MASTER", "--u", "0", "--v", "4", "--depth-mm", "9"], "at least 26.4 mm from the display for view"),
        (["view", "MASTER", "--u", "8", "--v", "4", "--depth-mm", "9"], "from (0, 0) to (7, 7), got (8, 4)"),
        (["view", "MASTER", "--centre", "--depth-mm", "600"], "at most 501.6 mm from the display, got 600"),
        (["view", "MASTER", "--eye", "0,0,400", "--depth-mm", "9"], "--depth-mm with --u and --v, or with --centre"),
        (["view", "MASTER", "--depth-mm", "9"], "expected either --u and --v, or --centre, or --eye"),
        (["view", "MASTER", "--centre", "--px-per-lens", "3"], "expected --px-per-lens with --depth-mm only"),
        (["view", "MASTER", "--centre", "--depth-mm", "9", "--px-per-lens", "0"], "at least one pixel a lens, got 0"),
        (
            ["view", "MASTER", "--centre", "--depth-mm", "9", "--px-per-lens", "9000"],
            "at most 32768 px a side",
        ),
        (["view", "MASTER", "--centre", "--scale", "2", "--size", "9"], "expected either --scale or --size, got both"),
        (["view", "MASTER", "--centre", "--scale", "0"], "expected a --scale above 0, got 0"),
        (["view", "MASTER", "--centre", "--scale", "1e9"], "expected a picture of at most 32768 px a side"),
        (["view", "MASTER", "--centre", "--size", "0"], "expected a --size of 1 to 32768 px, got 0"),
        (["view", "MASTER", "--centre", "--filter", "gauss"], "--filter: expected one of box, triangle, mitchell, "),
        (
            ["refocus", "MASTER", "--depth-mm", "9", "--method", "magic"],
            "--method: expected one of shift_and_sum, ciir, got 'magic'",
        ),
        (["refocus", "MASTER", "--depth-mm", "9", "--px-per-lens", "3"], "expected --px-per-lens with --method ciir"),
        (["refocus", "MASTER", "--depth-mm", "600", "--method", "ciir"], "at most 501.6 mm from the display, got 600"),
        (
            ["refocus", "MASTER", "--stack", "0:9:3", "--all-in-focus", "--method", "ciir"],
            "--all-in-focus with --method",
        ),
        (["refocus", "MASTER", "--stack", "0:600:300", "--scale", "9"], "at most 501.6 mm from the display, got 600"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_is_said_before_anything_is_written(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    master = master_of(tmp_path, rig_of())
    words = [
        str(master) if word == "MASTER" else word for word in (*arguments, "--out", str(tmp_path / "new" / "a.png"))
    ]
    monkeypatch.setattr(sys, "argv", ["lippmann", *words])
    with pytest.raises(SystemExit) as ended:
        main.main()
    assert ended.value.code == 2
    assert said in " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [master]


def test_a_size_keeps_the_shape_of_a_picture() -> None:
    assert PictureSize(longer_px=100).of(30, 60) == (50, 100)
    assert PictureSize(scale=0.001).of(30, 60) == (1, 1)
    assert PictureSize().of(30, 60) == (30, 60)
    with pytest.raises(BadInput, match=f"at most {MAX_SIDE_PX} px a side, got 60000"):
        PictureSize(scale=1000).of(30, 60)
