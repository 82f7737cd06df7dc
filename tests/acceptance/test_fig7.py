"""Fig. 7 of the paper: four positions of the array, one job of four frames, and depth on the side the captions say.

Small: 6 px under each lens in place of 24, the same optics and the same array of 100 x 100 lenses.
"""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.farm import LIPPMANN
from tests.pictures import read_png

OFF_MM = 3.5
"""Measured depth against the exact trace: the flank of the fish is a few millimetres deep itself."""


@pytest.fixture(scope="module", params=["orthographic", "pinhole"])
def out(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that `lippmann paper fig7 --quick` writes, with either camera."""
    folder = tmp_path_factory.mktemp("fig7")
    command = [LIPPMANN, "paper", "fig7", "--quick", "--camera", request.param, "--json", "--out", str(folder)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended.stderr
    return folder


@pytest.fixture(scope="module")
def positions(out: Path) -> list[dict[str, Any]]:
    """The measured depths, (a) to (d)."""
    said = json.loads((out / "fig7.json").read_text())
    assert said["settings"]["frames"] == "1-4"
    found: list[dict[str, Any]] = said["measured"]["positions"]
    return found


def depths_mm(position: dict[str, Any]) -> tuple[float, list[float]]:
    """Return the measured depth of the fish, and those of the four stems from the nearest to the farthest."""
    fish, *stems = (depth["measured_mm"] for depth in position["depths"])
    return fish, stems


def test_the_array_stands_where_the_paper_has_it(positions: list[dict[str, Any]]) -> None:
    assert [(position["letter"], position["offset_mm"]) for position in positions] == [
        ("a", 60),
        ("b", 40),
        ("c", 10),
        ("d", -10),
    ]


def test_a_everything_is_real(positions: list[dict[str, Any]]) -> None:
    fish, stems = depths_mm(positions[0])
    assert fish > 0
    assert all(stem > 0 for stem in stems)


def test_b_the_fish_is_real_and_the_stems_stand_just_behind_the_array(positions: list[dict[str, Any]]) -> None:
    """They stand on both sides of it, most of them behind, and none as far as the fish in front."""
    fish, stems = depths_mm(positions[1])
    assert fish > 20
    assert -15 < sum(stems) / len(stems) < 0
    assert sum(stem < 0 for stem in stems) == 3
    assert max(map(abs, stems)) < 25


def test_c_the_fish_is_just_in_front_and_the_stems_are_virtual(positions: list[dict[str, Any]]) -> None:
    fish, stems = depths_mm(positions[2])
    assert 0 < fish < 15
    assert all(stem < -15 for stem in stems)


def test_d_everything_is_virtual(positions: list[dict[str, Any]]) -> None:
    fish, stems = depths_mm(positions[3])
    assert fish < -5
    assert all(stem < -30 for stem in stems)


def test_every_measured_depth_is_that_of_the_exact_trace(positions: list[dict[str, Any]]) -> None:
    assert [position["agrees"] for position in positions] == ["yes", "as a group", "yes", "yes"]
    for position in positions:
        for depth in position["depths"]:
            off_mm = depth["measured_mm"] - depth["by_exact_trace_mm"]
            assert abs(off_mm) < OFF_MM, (position["letter"], depth)
            assert depth["likeness"] > 0.5, (position["letter"], depth)


def test_the_stems_stand_one_behind_the_other(positions: list[dict[str, Any]]) -> None:
    for position in positions:
        fish, stems = depths_mm(position)
        assert [fish, *stems] == sorted([fish, *stems], reverse=True)


def test_every_position_has_its_picture(out: Path) -> None:
    for letter in "abcd":
        assert read_png(out / f"fig7{letter}.png").shape == (600, 600, 3)
    assert read_png(out / "fig7.png").shape[1] > 1500
