"""`lippmann view` and `lippmann refocus` on masters made here."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from lippmann.cli import main
from lippmann.cli.option_values import depths_of
from lippmann.errors import BadInput
from lippmann.job.optics.rig import Rig
from lippmann.job.rendering.channels import channel_attributes
from lippmann.lightfield.views.square_pixels import nearest_as_square
from lippmann.lightfield.views.views import view
from lippmann.local.image import open_orthoscopic
from lippmann.plan.sampling import display_size
from tests.unit.lippmann.local.masters import master_of, rig_of, said_by
from worker.images.read import read_attributes, read_channels, read_rgb
from worker.images.write import write_channels, write_png


@pytest.fixture(params=["square", "hexagonal"])
def rig(request: pytest.FixtureRequest) -> Rig:
    return rig_of(request.param)


@pytest.fixture
def master(rig: Rig, tmp_path: Path) -> Path:
    return master_of(tmp_path, rig)


def test_a_master_brings_its_lenses_along(master: Path, rig: Rig) -> None:
    found = open_orthoscopic(master)
    assert found.layout == display_size(rig)
    assert (found.pitch_mm, found.focal_length_mm) == (1.0, 3.3)
    assert found.pixels.dtype == np.float16
    assert set(read_attributes(master)) == {"rig"}


@pytest.mark.parametrize(
    ("options", "dark"),
    [(["--centre"], False), (["--u", "2", "--v", "3"], False), (["--eye", "0,0,400"], False),
     (["--eye", "60,-5,400"], True)],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
def test_view_writes_one_pixel_a_lens(
    options: list[str], dark: bool, master: Path, rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    out = tmp_path / "new" / "view.png"
    said = said_by("view", str(master), *options, "--out", str(out), monkeypatch=monkeypatch, capsys=capsys)
    rows, cols = display_size(rig).square_size()
    assert (said["file"], said["rows"], said["cols"]) == (str(out), rows, cols)
    assert (said["dark_lenses"] > 0) == dark
    assert read_rgb(out, np.float32).shape == (rows, cols, 3)


def test_refocus_is_brightest_at_the_points_depth(
    master: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "stack")
    said = said_by("refocus", str(master), "--stack", "-10:30:10", "--out", out, monkeypatch=monkeypatch, capsys=capsys)
    assert said["depths_mm"] == [-10, 0, 10, 20, 30]
    assert [Path(file).name for file in said["files"]] == [
        "-0010.00mm.png", "+0000.00mm.png", "+0010.00mm.png", "+0020.00mm.png", "+0030.00mm.png",
    ]  # fmt: skip
    brightest = [read_rgb(Path(file), np.float32).max() for file in said["files"]]
    assert np.argmax(brightest) == 3


def test_refocus_at_one_depth_and_all_in_focus_write_one_picture(
    master: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for options in (
        ["--depth-mm", "-7.5"],
        ["--stack", "10:30:5", "--all-in-focus"],
        ["--stack", "20:20:1", "--all-in-focus"],
        ["--stack", "20:20:1", "--extended"],
    ):
        out = tmp_path / "one.png"
        said = said_by("refocus", str(master), *options, "--out", str(out), monkeypatch=monkeypatch, capsys=capsys)
        assert said["files"] == [str(out)]
        assert said["all_in_focus"] == ("--stack" in options), "--extended is the old name"
        assert read_rgb(out, np.float32).any()


def test_a_stack_of_one_depth_is_a_folder_with_one_picture(
    master: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "stack"
    said_by("refocus", str(master), "--stack", "20:20:1", "--out", str(out), monkeypatch=monkeypatch, capsys=capsys)
    assert [path.name for path in out.iterdir()] == ["+0020.00mm.png"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["view", "MASTER", "--out", "a.png"], "expected either --u and --v, or --centre, or --eye"),
        (["view", "MASTER", "--u", "1", "--out", "a.png"], "expected either --u and --v, or --centre, or --eye"),
        (["view", "MASTER", "--centre", "--eye", "0,0,1", "--out", "a.png"], "expected either --u and --v"),
        (["view", "MASTER", "--u", "8", "--v", "0", "--out", "a.png"], "from (0, 0) to (7, 7), got (8, 0)"),
        (["view", "MASTER", "--u", "-1", "--v", "0", "--out", "a.png"], "from (0, 0) to (7, 7), got (-1, 0)"),
        (["view", "MASTER", "--eye", "0,0,-400", "--out", "a.png"], "in front of the display, at a distance above 0"),
        (["view", "MASTER", "--eye", "0,0", "--out", "a.png"], "expected an eye as X,Y,Z in mm, got 0,0"),
        (["view", "MASTER", "--eye", "0,nan,1", "--out", "a.png"], "expected an eye as X,Y,Z in mm, got 0,nan,1"),
        (["view", "MASTER", "--centre", "--out", "a.tiff"], "expected a .png in --out, got a.tiff"),
        (["view", "nowhere.exr", "--centre", "--out", "a.png"], "got nowhere.exr: there is no such file"),
        (
            ["view", "MASTER", "--centre", "--channel", "smell", "--out", "a.png"],
            "expected one of normal, albedo, object, motion",
        ),
        (
            ["view", "MASTER", "--centre", "--channel", "normal", "--size", "9", "--out", "a.png"],
            "its numbers do not mix",
        ),
        (["view", "MASTER", "--centre", "--channel", "normal", "--out", "a.gif"], "expected .png, .exr, .pfm in --out"),
        (
            ["view", "MASTER", "--centre", "--channel", "normal", "--out", "a.png"],
            "a job with normal in capture.channels",
        ),
        (
            ["view", "nowhere.exr", "--centre", "--channel", "normal", "--out", "a.png"],
            "got nowhere.exr: there is no such file",
        ),
        (["refocus", "MASTER", "--out", "a.png"], "expected either --depth-mm, or --stack"),
        (["refocus", "MASTER", "--depth-mm", "1", "--all-in-focus", "--out", "a.png"], "expected either --depth-mm"),
        (["refocus", "MASTER", "--depth-mm", "600", "--out", "a.png"], "at most 501.6 mm from the display, got 600"),
        (["refocus", "MASTER", "--depth-mm", "nan", "--out", "a.png"], "expected a depth and a positive focal length"),
        (["refocus", "MASTER", "--depth-mm", "10", "--out", "folder"], "expected a .png in --out, got folder"),
        (["refocus", "MASTER", "--stack", "10:0:1", "--out", "a"], "expected depths that count up"),
        (["refocus", "MASTER", "--stack", "0:10:0", "--out", "a"], "expected depths that count up"),
        (["refocus", "MASTER", "--stack", "0:10", "--out", "a"], "expected depths as A:B:STEP in mm, got 0:10"),
        (["refocus", "MASTER", "--stack", "0:100:0.01", "--out", "a"], "expected at most 1000 depths, got 10001"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_what_cannot_be_is_said_before_anything_is_written(
    arguments: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    master = master_of(tmp_path, rig_of())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["lippmann", *(str(master) if word == "MASTER" else word for word in arguments)])
    with pytest.raises(SystemExit) as ended:
        main.main()
    assert ended.value.code == 2
    assert said in " ".join(capsys.readouterr().err.split())
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [master]


def test_view_writes_a_channel_and_names_its_objects(
    master: Path, rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    layout = display_size(rig)
    numbers = np.arange(layout.rows * layout.cols, dtype=np.float32).reshape(layout.rows, layout.cols, 1)
    file = tmp_path / "channels" / "0001.exr"
    file.parent.mkdir()
    attributes = channel_attributes(("object",), ("fish", "water"))
    write_channels(file, [numbers], ["object.id"], size=numbers.shape[:2], attributes=attributes)
    out = tmp_path / "object.exr"
    more = ["--channel", "object", "--u", "2", "--v", "3", "--out", str(out)]
    said = said_by("view", str(master), *more, monkeypatch=monkeypatch, capsys=capsys)
    assert (said["rows"], said["cols"]) == layout.square_size()
    assert said["objects"] == ["fish", "water"]
    assert said["view"] == {"u": 2, "v": 3}
    expected = nearest_as_square(view(numbers, layout, 2, 3), layout)
    np.testing.assert_array_equal(read_channels(out, ["object.id"]), expected)


@pytest.mark.parametrize("folder", ["integral", "views", "depth", "channels"])
def test_other_masters_of_the_same_size_are_refused(folder: str, tmp_path: Path) -> None:
    master = master_of(tmp_path, rig_of())
    other = master.parent.rename(tmp_path / folder) / master.name
    with pytest.raises(BadInput, match=r"expected an orthoscopic master, as orthoscopic/0001\.exr"):
        open_orthoscopic(other)


def test_a_picture_of_another_size_than_its_lenses_is_refused(tmp_path: Path) -> None:
    master = master_of(tmp_path, rig_of(), said=rig_of().model_copy(update={"px_per_lens": 9}).model_dump_json())
    with pytest.raises(BadInput, match=r"180 x 189 px for 20 x 21 lenses of 9 px, got 160 x 168 px"):
        open_orthoscopic(master)


def test_a_picture_without_a_rig_or_with_another_kind_of_rig_is_refused(tmp_path: Path) -> None:
    plain = tmp_path / "plain.png"
    write_png(plain, np.ones((4, 4, 3), dtype=np.float32))
    with pytest.raises(BadInput, match=r"expected a master \(EXR\) whose header names its rig"):
        open_orthoscopic(plain)
    with pytest.raises(BadInput, match="the rig in the header"):
        open_orthoscopic(master_of(tmp_path, rig_of(), said='{"px_per_lens": "many"}'))


def test_a_file_that_is_no_picture_is_refused(tmp_path: Path) -> None:
    text = tmp_path / "text.exr"
    text.write_text("no picture")
    with pytest.raises(BadInput, match=r"expected a whole picture at .*text\.exr"):
        open_orthoscopic(text)


def test_depths_include_both_ends_where_the_step_meets_them() -> None:
    assert depths_of("0:0.3:0.1") == (0.0, 0.1, 0.2, 0.3)
    assert depths_of("-1:1:1.5") == (-1.0, 0.5)
