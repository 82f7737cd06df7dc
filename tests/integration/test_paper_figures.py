"""`lippmann paper`: every figure in small, as a user makes it. Fig. 7 is in tests/acceptance."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest

from tests.farm import LIPPMANN
from tests.pictures import read_png

FILES = {
    "fig3": ["fig3.png", "fig3-integral.png"],
    "fig4": ["fig4.png", "fig4-integral.png"],
    "fig5": ["fig5.png", "fig5a.png", "fig5b.png"],
    "fig8": ["fig8.png", "fig8.svg"],
    "fig9": ["fig9.png", "fig9.svg"],
    "fig10": ["fig10.png", "fig10a.png", "fig10b.png"],
    "fig11": ["fig11.png", "fig11-16-views.png", "fig11.mp4"],
}


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([LIPPMANN, "paper", *arguments], capture_output=True, text=True, check=False)


def make(name: str, out: Path) -> dict[str, Any]:
    """Make a figure in small; return its numbers, which its file says too."""
    ended = run(name, "--quick", "--json", "--out", str(out))
    assert ended.returncode == 0, ended.stderr
    said: dict[str, Any] = json.loads(ended.stdout)
    kept = json.loads((out / f"{name}.json").read_text())
    assert kept == said | {"files": FILES[name]}
    assert said["files"] == [str(out / file) for file in [*FILES[name], f"{name}.json"]]
    assert f"{name}: " in ended.stderr, "progress"
    assert said["quick"]
    assert said["machine"]["cores"] >= 1
    assert said["machine"]["povray"].startswith("3.")
    for file in FILES[name]:
        assert (out / file).stat().st_size > 0
    measured: dict[str, Any] = said["measured"]
    return measured


@pytest.mark.parametrize(("name", "rows"), [("fig3", 200), ("fig4", 25 * 7 + 4)])
def test_a_sample_is_a_whole_sheet_and_an_enlarged_part_beside_it(tmp_path: Path, name: str, rows: int) -> None:
    measured = make(name, tmp_path)
    sheet = read_png(tmp_path / f"{name}-integral.png")
    assert sheet.shape[:2] == (measured["rows_px"], measured["cols_px"])
    assert (sheet.shape[0], measured["px_per_lens"]) == (rows, 8)
    assert sheet.std() > 20
    assert read_png(tmp_path / f"{name}.png").shape[1] > 1400


def test_the_image_behind_the_lens_is_turned_and_as_small_as_the_matrices_say(tmp_path: Path) -> None:
    measured = make("fig5", tmp_path)
    assert measured["orientation"] == "turned by 180 degrees"
    likeness = measured["likeness"]
    turned = likeness.pop("turned by 180 degrees")
    assert turned > 0.7
    assert turned > 0.2 + max(likeness.values())
    assert measured["magnification"] == pytest.approx(-0.2843843, rel=0.005)


def test_time_grows_with_pixels_per_lens(tmp_path: Path) -> None:
    measured = make("fig8", tmp_path)
    assert [run["px"] for run in measured["runs"]] == [400 * n * n for n in (4, 8, 12)]
    times = [run["cpu_s"] for run in measured["runs"]]
    assert times == sorted(times)
    assert measured["fit"]["slope"] > 0


def test_time_grows_with_the_samples_of_antialiasing(tmp_path: Path) -> None:
    measured = make("fig9", tmp_path)
    off = measured["off"]
    assert off["samples"] >= off["px"]
    for method in ("method_1", "method_2"):
        fine, rough = measured[method]
        assert (fine["threshold"], rough["threshold"]) == (0.05, 0.4)
        assert fine["samples"] > rough["samples"] > off["samples"]
        assert fine["trace_cpu_s"] > off["trace_cpu_s"]
    assert measured["fit"]["slope"] > 0


def test_two_frames_of_the_video_differ_where_the_fish_turns(tmp_path: Path) -> None:
    measured = make("fig10", tmp_path)
    first, second = (read_png(tmp_path / f"fig10{letter}.png").astype(int) for letter in "ab")
    assert first.shape == second.shape == (120, 120, 3)
    changed = np.abs(first - second).max(axis=-1) > 0
    assert changed[40:80, 40:80].mean() > changed[:20].mean()
    assert 0 < measured["px_that_changed"] < 1


def test_two_frames_hold_sixteen_views_in_a_row_and_a_movie_of_all(tmp_path: Path) -> None:
    measured = make("fig11", tmp_path)
    assert measured["views_in_a_row_of_two_frames"] == 16
    with av.open(str(tmp_path / "fig11.mp4")) as movie:
        assert sum(1 for _ in movie.decode(video=0)) == measured["views_in_the_movie"] == 128
    left, right = (read_png(tmp_path / "fig11.png")[14:374, start : start + 360].astype(int) for start in (14, 762))
    assert np.abs(left - right).mean() > 5, "the extreme views are not the same picture"


def test_a_folder_that_cannot_be_written_is_said_before_anything_is_rendered(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    ended = run("fig3", "--quick", "--out", str(tmp_path / "file"))
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "expected a folder that can be written" in ended.stderr
