"""A picture comes out, and what it cost is known."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import PovrayMissing, RenderFailed
from tests.integration.povray.conftest import BALL, ENDLESS_TRACE, Room
from worker.engines.engine import Region
from worker.engines.povray.answers.messages import Statistics, unwrap
from worker.engines.povray.answers.progress import Phase
from worker.engines.povray.pictures.pixels import read_codes, read_region
from worker.sandbox.output import LOG_PROGRESS_S


def test_a_picture_comes_out_and_progress_reaches_one(room: Room) -> None:
    outcome = room.render(BALL, cols=200, rows=150)
    assert outcome.picture == room.task_dir / "tile.exr"
    assert outcome.picture.read_bytes().startswith(b"\x76\x2f\x31\x01")
    fractions = [progress.fraction for progress in room.heard]
    assert all(before <= after for before, after in pairwise(fractions))
    assert fractions[-1] == 1.0
    assert not outcome.radiosity_seen
    assert not outcome.photons_seen


def test_the_seconds_of_povray_are_counted_through_the_sandbox(room: Room) -> None:
    outcome = room.render("#declare I = 0; #while (I < 400000) #declare I = I + 1; #end\n" + BALL, cols=320, rows=240)
    said = outcome.statistics
    assert said.parse_s > 0.1
    assert said.trace_s > 0
    assert outcome.cpu_s >= said.parse_cpu_s + said.trace_cpu_s
    assert outcome.wall_s >= said.parse_s + said.trace_s
    assert outcome.peak_memory_mb > 10


def test_clock_and_declares_reach_the_scene(best: Room) -> None:
    check = "#if (clock != 0.25 | Lens_Cols != 90 | abs(Tiny + 1e-7) > 1e-12) #error concat(str(Tiny, 0, 12)) #end\n"
    best.render(check + BALL, clock=0.25, declares={"Lens_Cols": 90, "Tiny": -1e-7})
    with pytest.raises(Exception, match="Parse halted"):
        best.render(check + BALL, clock=0.5, declares={"Lens_Cols": 90, "Tiny": -1e-7})


def test_a_region_is_written_at_full_size(best: Room) -> None:
    outcome = best.render(
        BALL, region=Region(8, 16, 0, 64), cols=64, rows=48, picture="tile.ppm", picture_format="ppm16"
    )
    codes = read_codes(outcome.picture)
    assert codes.shape == (48, 64, 3)
    assert codes[8:16].any()
    assert not codes[:8].any()
    assert not codes[16:].any()
    assert best.heard[-1].count == 8 * 64


def test_codes_are_the_light_of_an_exr(best: Room) -> None:
    colours = "gradient x scale 4 color_map { [0 rgb 0] [1 rgb <1, 0.5, 0.2>] }"
    ramp = f"plane {{ z, 0 pigment {{ {colours} }} finish {{ ambient 1 diffuse 0 }} }}"
    light = read_region(best.render(ramp).picture, Region(0, 48, 0, 64)).astype(np.float64)
    codes = read_codes(best.render(ramp, picture="tile.ppm", picture_format="ppm16").picture)
    assert len(np.unique(codes)) > 100
    np.testing.assert_allclose(codes / 65535, light, atol=2**-11)


def test_photons_and_radiosity_are_seen_and_progress_still_never_falls(best: Room) -> None:
    (best.task_dir / "tile.pov").write_text(
        """#version 3.7;
        global_settings { assumed_gamma 1 photons { spacing 0.02 }
          radiosity { pretrace_start 0.08 pretrace_end 0.005 count 20 } }
        camera { location <0,0,-5> look_at 0 } light_source { <5,5,-5> 1 }
        sphere { 0, 1 pigment { rgbt 1 } interior { ior 1.5 } photons { target refraction on reflection on } }
        plane { y, -1 pigment { rgb 0.7 } }"""
    )
    outcome = best.render(cols=200, rows=150)
    assert outcome.radiosity_seen
    assert outcome.photons_seen
    fractions = [progress.fraction for progress in best.heard]
    assert all(before <= after for before, after in pairwise(fractions))
    assert fractions[-1] == 1.0


def test_includes_and_textures_come_from_the_bundle_through_a_relative_link(
    best: Room, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (best.bundle / "inner.inc").write_text(BALL)
    (tmp_path / "link").symlink_to(best.bundle)
    monkeypatch.chdir(tmp_path)
    best.bundle = Path("link")
    best.task_dir = Path("task")
    assert best.render('#include "inner.inc"\n').picture.exists()
    best.task_dir = tmp_path / "task"


def test_a_povray_ini_that_lies_about_is_not_read(best: Room) -> None:
    (best.task_dir / "povray.ini").write_text("Height=7\nNonsense=1\n")
    (best.task_dir / ".povray").mkdir()
    povray = _script(best, 'cp ../povray.ini . && exec povray "$@"')
    assert best.render(BALL, rows=48, program=povray).statistics.trace_s >= 0


def test_the_log_has_the_command_the_messages_and_little_progress(room: Room) -> None:
    room.render('#warning "the author warns"\n' + BALL, cols=640, rows=480)
    lines = room.log.read_text().splitlines()
    assert lines[0].startswith("$ ")
    assert "+Itile.pov" in lines[0]
    warning = f"File '{room.task_dir}/tile.pov' line 3: Parse Warning: the author warns"
    assert warning in unwrap(lines)
    assert "POV-Ray finished" in lines
    assert 1 <= sum(line.startswith("Rendered ") for line in lines) <= 3 + LOG_PROGRESS_S
    assert "Rendered 307200 of 307200 pixels (100%)" in lines


def test_a_division_by_zero_is_a_warning_to_povray_and_is_in_the_log(best: Room) -> None:
    best.render("#declare A = 1/0;\n" + BALL)
    warning = f"File '{best.task_dir}/tile.pov' line 3: Parse Warning: Divide by zero."
    assert warning in unwrap(best.log.read_text().splitlines())


def test_a_picture_of_an_earlier_attempt_does_not_pass_for_a_new_one(best: Room) -> None:
    best.render(BALL)
    povray = _script(best, "exit 0")
    with pytest.raises(RenderFailed, match="left no picture"):
        best.render(BALL, program=povray)
    povray = _script(best, "echo rubbish > tile.exr")
    with pytest.raises(RenderFailed, match="broken"):
        best.render(BALL, program=povray)


def test_povray_is_started_again_when_its_start_fails_by_its_own_fault(room: Room) -> None:
    povray = _script(
        room,
        # Landlock refuses other processes, so this shell counts by itself.
        "echo again >> starts; n=0; while read -r _; do n=$((n + 1)); done < starts; if [ $n -le 2 ]; then\n"
        'echo "Timed out waiting for worker thread startup" >&2; exit 1; fi; exec povray "$@"',
    )
    outcome = room.render(BALL, program=povray)
    assert outcome.picture.exists()
    assert room.log.read_text().count("fault of its own") == 2


def test_povray_is_not_started_for_ever(best: Room) -> None:
    povray = _script(best, 'echo "Timed out waiting for worker thread startup" >&2; exit 1')
    with pytest.raises(RenderFailed, match="again and again"):
        best.render(BALL, program=povray)
    assert best.log.read_text().count("fault of its own") == 4


def test_a_worker_without_povray_says_so(best: Room) -> None:
    with pytest.raises(PovrayMissing, match="povray-of-tomorrow"):
        best.render(BALL, program="povray-of-tomorrow")


def test_statistics_are_of_the_work(best: Room) -> None:
    few = best.render(ENDLESS_TRACE, cols=16, rows=12).statistics
    assert few != Statistics()
    assert few.trace_cpu_s > few.parse_cpu_s
    assert Phase.RENDERING in {progress.phase for progress in best.heard}


def _script(room: Room, text: str) -> str:
    """Return a stand-in for POV-Ray's own faults, which cannot be had at will."""
    program = room.bundle / "povray"
    program.write_text(f"#!/bin/sh\n{text}\n")
    program.chmod(0o755)
    return str(program)
