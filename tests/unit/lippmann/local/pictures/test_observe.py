"""`lippmann observe` on masters made here."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lippmann.cli import main
from lippmann.job.optics.rig import Rig
from lippmann.lightfield.observer.observe import observe, whole_window
from lippmann.lightfield.observer.window import window_of
from lippmann.lightfield.sheet.device import to_device
from lippmann.lightfield.views.perspective import Eye
from lippmann.plan.design.observed_display import observed_display
from lippmann.plan.sampling import display_size
from tests.pictures import read_png
from tests.unit.lippmann.lightfield.textures import sheet_of_texture, spot
from worker.images.colour import srgb_codes
from worker.images.read import read_rgb
from worker.images.write import write_exr
from worker.video.read import read_frames

DEPTH_MM = 20.0


def rig_of(**more: Any) -> Rig:
    array = {"count": (21, 20), "substrate_mm": 3.3}
    return Rig.model_validate({"px_per_lens": 8, "lens_array": array, "device": {"dpi": 600}, **more})


def master_of(folder: Path, rig: Rig) -> Path:
    """Write masters of a point in front of the display, and return the orthoscopic one."""
    layout = display_size(rig)
    light = sheet_of_texture(layout, spot, DEPTH_MM, focal_mm=3.3).repeat(3, axis=2)
    shown = {"orthoscopic": light, "device": to_device(light, layout, px_per_lens_device=600 / 25.4)}
    for name, sheet in shown.items():
        (folder / name).mkdir(parents=True)
        write_exr(folder / name / "0001.exr", sheet, attributes={"rig": rig.model_dump_json()})
    return folder / "orthoscopic" / "0001.exr"


@pytest.fixture
def master(tmp_path: Path) -> Path:
    return master_of(tmp_path, rig_of())


class Run:
    """Runs the command in this process."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
        self._monkeypatch, self._capsys = monkeypatch, capsys

    def __call__(self, *arguments: str) -> tuple[int, dict[str, Any], str]:
        """Return (exit code, what it said as JSON, notes and errors)."""
        self._monkeypatch.setattr(sys, "argv", ["lippmann", "observe", *arguments, "--json"])
        with pytest.raises(SystemExit) as ended:
            main.main()
        said = self._capsys.readouterr()
        return int(ended.value.code or 0), json.loads(said.out or "{}"), " ".join(said.err.split())


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    return Run(monkeypatch, capsys)


def test_it_writes_what_the_observer_sees(master: Path, run: Run, tmp_path: Path) -> None:
    out = tmp_path / "new" / "eye.png"
    code, said, notes = run(str(master), "--eye", "12,-5,400", "--size", "60", "--out", str(out))
    assert code == 0, notes
    display = observed_display(rig_of())
    window = whole_window(display, size_px=60)
    seen = observe(read_rgb(master, np.float16), display, Eye(12, -5, 400), window=window)
    np.testing.assert_array_equal(read_png(out), srgb_codes(seen))
    assert (said["file"], said["rows"], said["cols"]) == (str(out), 60, 57)
    assert (said["gap_mm"], said["depths_times"], said["own_share"], notes) == (3.3, 1.0, 1.0, "")


def test_every_option_of_the_eye_and_the_display_counts(master: Path, run: Run, tmp_path: Path) -> None:
    out = tmp_path / "eye.png"
    code, said, notes = run(
        str(master), "--eye", "0,0,300", "--out", str(out), "--pupil-mm", "6", "--focus-mm", "25", "--rays", "9",
        "--physical-gap-mm", "4.8", "--part", "1,2,6,4", "--size", "48", "--bare", "black", "--device",
        "--surround", "white",
    )  # fmt: skip
    assert code == 0, notes
    display = observed_display(rig_of(), gap_mm=1.5 + 3.3 / 1.49, on_device=True, bare="black", surround="white")
    sheet = read_rgb(master.parents[1] / "device" / "0001.exr", np.float32)
    window = window_of(right_mm=1, up_mm=2, wide_mm=6, high_mm=4, size_px=48)
    seen = observe(sheet, display, Eye(0, 0, 300), pupil_mm=6.0, focus_mm=25.0, rays=9, window=window)
    np.testing.assert_allclose(read_png(out), srgb_codes(seen), atol=1)  # the device sheet was kept in half floats
    assert said["depths_times"] == pytest.approx(3.7148 / 3.3, rel=1e-4)
    assert "this gap multiplies depths by 1.13" in notes


def test_a_device_master_is_seen_on_its_own_pixels(master: Path, run: Run, tmp_path: Path) -> None:
    same = ["--eye", "10,0,400", "--size", "40"]
    on_device = master.parents[1] / "device" / "0001.exr"
    assert run(str(master), *same, "--device", "--out", str(tmp_path / "a.png"))[0] == 0
    assert run(str(on_device), *same, "--out", str(tmp_path / "b.png"))[0] == 0
    a, b = (read_png(tmp_path / name) for name in ("a.png", "b.png"))
    np.testing.assert_allclose(a, b, atol=1)


@pytest.mark.parametrize(("stereo", "cols"), [("side_by_side", 114), ("cross_eyed", 114), ("anaglyph", 57)])
def test_two_eyes_come_as_one_picture(stereo: str, cols: int, master: Path, run: Run, tmp_path: Path) -> None:
    out = tmp_path / "pair.png"
    code, said, _ = run(
        str(master), "--eye", "0,0,500", "--stereo", stereo, "--rays", "4", "--size", "60", "--out", str(out)
    )
    assert code == 0
    assert (said["rows"], said["cols"]) == (60, cols)
    assert read_png(out).shape == (60, cols, 3)


def test_a_clip_of_a_swinging_eye_shows_a_real_point_go_against_it(master: Path, run: Run, tmp_path: Path) -> None:
    out = tmp_path / "clip.mp4"
    code, said, notes = run(
        str(master), "--eye", "0,0,400", "--clip", "horizontal", "--seconds", "1", "--fps", "8", "--size", "63",
        "--out", str(out),
    )  # fmt: skip
    assert code == 0, notes
    frames = list(read_frames(out))
    assert len(frames) == 8
    assert frames[0].shape == (64, 60, 3)  # 63 x 60 px: in 4:2:0 an odd last row is shown twice
    assert (said["rows"], said["cols"]) == (63, 60)
    across = [(frame.sum(axis=(0, 2), dtype=float) * np.arange(60)).sum() / frame.sum(dtype=float) for frame in frames]
    assert across[2] < across[0] < across[6]


def test_an_eye_beside_the_viewing_zone_is_told_so(master: Path, run: Run, tmp_path: Path) -> None:
    code, said, notes = run(str(master), "--eye", "60,0,400", "--size", "20", "--out", str(tmp_path / "eye.png"))
    assert code == 0
    assert said["viewing_zone_mm"] == pytest.approx(400 / 3.3)
    assert said["own_share"] == pytest.approx(0.5, abs=0.06)  # the zone ends 60.6 mm from the axis of each lens
    assert "of the lenses show a cell of a neighbour" in notes


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--eye", "0,0,-400"], "expected an eye in front of the display, at a distance above 0 mm"),
        (["--eye", "0,0"], "expected an eye as X,Y,Z in mm, got 0,0"),
        (["--pupil-mm", "0"], "expected a pupil of a positive diameter in mm, got 0"),
        (["--focus-mm", "400"], "expected a focus nearer to the display than the eye, (0, 0, 400) mm, got 400 mm"),
        (["--gap-mm", "0"], "expected a positive gap in mm, got 0"),
        (["--gap-mm", "-3"], "expected a positive gap in mm, got -3"),
        (["--gap-mm", "2"], "expected a reduced gap of at least 2.215 mm"),
        (["--physical-gap-mm", "3"], "expected a physical gap of at least the substrate's 3.3 mm, got 3 mm"),
        (["--gap", "real"], "expected display.gap_real_mm, as no scene says which depths to serve, got none"),
        (["--gap-mm", "3", "--physical-gap-mm", "4"], "expected at most one of --gap, --gap-mm and --physical-gap-mm"),
        (["--size", "0"], "expected a picture of 1 to 8192 px a side, got 1 x 0"),
        (["--size", "100000"], "expected a picture of 1 to 8192 px a side, got 95238 x 100000"),
        (["--rays", "0"], "expected from 1 to 16384 rays a pixel, got 0"),
        (["--part", "0,0,5"], "expected a part of the display as X,Y,W,H in mm, got 0,0,5"),
        (["--part", "0,0,0,5"], "expected a window of a positive width and height in mm"),
        (["--stereo", "anaglyph", "--eye-distance-mm", "-1"], "expected a positive distance between the eyes in mm"),
        (["--stereo", "wiggle"], "--stereo: expected one of side_by_side, cross_eyed, anaglyph, got 'wiggle'"),
        (["--clip", "horizontal"], "expected a .mp4 in --out, got eye.png"),
        (["--clip", "horizontal", "--out", "a.mp4", "--fps", "0"], "expected a clip of 1 to 10000 frames, got 4 s"),
        (["--clip", "toward", "--out", "a.mp4", "--reach-mm", "400"], "comes nearer by less than its distance, 400 mm"),
        (["--clip", "horizontal", "--out", "a.mp4", "--pupil-mm", "0"], "expected a pupil of a positive diameter"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_what_cannot_be_is_said_before_anything_is_written(
    options: list[str], said: str, master: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    before = sorted(path for path in tmp_path.rglob("*") if path.is_file())
    usual = {"--eye": "0,0,400", "--out": "eye.png"}
    rest = [word for option, value in usual.items() if option not in options for word in (option, value)]
    code, _, error = run(str(master), *options, *rest)
    assert code == 2, error
    assert said in error.replace("│ ", "")
    assert sorted(path for path in tmp_path.rglob("*") if path.is_file()) == before


def test_a_rig_without_a_device_has_no_devices_pixels(run: Run, tmp_path: Path) -> None:
    master = master_of(tmp_path, rig_of(device=None))
    code, _, error = run(str(master), "--eye", "0,0,400", "--device", "--out", str(tmp_path / "eye.png"))
    assert code == 2
    assert "expected a rig with a device, whose pixels are to be seen, got rig.device null" in error


def test_other_masters_and_missing_ones_are_refused(master: Path, run: Run, tmp_path: Path) -> None:
    for path, said in (
        (tmp_path / "nowhere.exr", "there is no such file"),
        (master.parent.rename(tmp_path / "views") / "0001.exr", "expected an orthoscopic master"),
    ):
        code, _, error = run(str(path), "--eye", "0,0,400", "--out", str(tmp_path / "eye.png"))
        assert (code, said in error) == (2, True), error
