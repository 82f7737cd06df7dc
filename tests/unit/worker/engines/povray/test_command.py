"""POV-Ray's command line, as exact lists."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.job.rendering.render_settings import Antialias
from worker.engines.engine import Region
from worker.engines.povray.command import RenderCommand, povray_argv


def test_a_whole_picture_is_asked_for_with_every_option_said() -> None:
    assert povray_argv(RenderCommand("tile.pov", "tile.exr", cols=720, rows=480)) == [
        "povray",
        "+Itile.pov",
        "+Otile.exr",
        "+FE",
        "+W720",
        "+H480",
        "-D",
        "-P",
        "-A",
        "+V",
        "+WT1",
        "+K0.0",
        "+L/usr/share/povray-3.7/include",
    ]


def test_a_tile_is_asked_for_by_rows_and_columns_from_one_inclusive() -> None:
    command = RenderCommand(
        "tile.pov",
        "tile.ppm",
        cols=720,
        rows=480,
        picture_format="ppm16",
        region=Region(0, 32, 64, 720),
        clock=0.1,
        declares={"Lens_Cols": 90, "A": 1e-7},
        library_paths=(Path("/b"), Path("/my models"), Path("/R,D=1")),
        threads=2,
        program="/opt/povray",
    )
    assert povray_argv(command) == [
        "/opt/povray",
        "+Itile.pov",
        "+Otile.ppm",
        "+FP16",
        "File_Gamma=1.0",
        "+W720",
        "+H480",
        "+SR1",
        "+ER32",
        "+SC65",
        "+EC720",
        "-D",
        "-P",
        "-A",
        "+V",
        "+WT2",
        "+K0.1",
        "Declare=A=1e-07",
        "Declare=Lens_Cols=90.0",
        "+L/b",
        '+L"/my models"',
        '+L"/R,D=1"',
    ]


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_the_clock_on_the_command_line_is_the_clock(clock: float) -> None:
    argv = povray_argv(RenderCommand("a.pov", "a.exr", cols=1, rows=1, clock=clock))
    assert [float(word[2:]) for word in argv if word.startswith("+K")] == [clock]


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_number_that_is_none_is_refused(value: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        RenderCommand("a.pov", "a.exr", cols=1, rows=1, clock=value)
    with pytest.raises(ValueError, match="finite"):
        RenderCommand("a.pov", "a.exr", cols=1, rows=1, declares={"X": value})


@pytest.mark.parametrize("region", [(0, 0, 0, 1), (0, 11, 0, 1), (0, 1, 3, 3), (-1, 1, 0, 1), (0, 1, 0, 21)])
def test_a_region_outside_the_picture_is_refused(region: tuple[int, int, int, int]) -> None:
    with pytest.raises(ValueError, match="inside 10 x 20 px"):
        RenderCommand("a.pov", "a.exr", cols=20, rows=10, region=Region(*region))


def test_the_first_block_is_smaller_in_a_small_picture() -> None:
    assert RenderCommand("a.pov", "a.exr", cols=100, rows=100).first_block_px == 1024
    assert RenderCommand("a.pov", "a.exr", cols=100, rows=8).first_block_px == 256
    assert RenderCommand("a.pov", "a.exr", cols=100, rows=100, region=Region(0, 8, 90, 100)).first_block_px == 80


def test_antialiasing_is_told_without_jitter() -> None:
    command = RenderCommand("a.pov", "a.exr", cols=8, rows=8, antialias=Antialias(threshold=0.25, method=2, depth=3))
    argv = povray_argv(command)
    assert argv[argv.index("-P") + 1 : argv.index("+V")] == ["+A0.25", "+AM2", "+R3", "-J"]
