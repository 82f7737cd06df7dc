"""Every way in which a request to the program ends, and that nothing of its files is believed."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lippmann.errors import (
    LippmannError,
    OutOfMemory,
    RenderCrashed,
    RenderFailed,
    RenderStalled,
    RenderTimedOut,
    SandboxMissing,
    SceneError,
    Stopped,
)
from tests.unit.worker.engines.mitsuba.conftest import KEY, Room
from tests.waiting import until


def test_a_region_comes_back_as_numbers_with_what_it_took(room: Room) -> None:
    progress: list[float] = []
    rendered = room.ask(on_progress=progress.append)
    light = rendered.pixels["radiance"]
    assert (light.shape, light.dtype.name) == ((1, 2, 3), "float32")
    assert light.tolist() == [[[0.25] * 3] * 2]
    assert progress == [0.5]
    assert 0 < rendered.cpu_s < 60
    assert rendered.peak_memory_mb > 1
    assert (room.root / "log.txt").read_text().endswith(f"served 0\n{rendered.notes[1]}\n")


@pytest.mark.parametrize(
    ("behaviour", "error", "message"),
    [
        ("kill", RenderCrashed, "ended by SIGKILL"),
        ("abort", RenderCrashed, "ended by SIGABRT: LLVM ERROR: Cannot select"),
        ("garbage", RenderFailed, "ended with 3 and without an answer"),
        ("refuse", SceneError, "scene.xml: no such plugin"),
        ("hog", OutOfMemory, "MB"),
        ("folder", RenderFailed, "got a folder"),
        ("link", RenderFailed, "expected a file 1-radiance.f32 from Mitsuba, got none"),
        ("long", RenderFailed, "expected at most 24 bytes in 1-radiance.f32, got 28"),
        ("short", RenderFailed, "expected 24 bytes in 1-radiance.f32, got 20"),
        ("nan", RenderFailed, "got nan, nan, nan at row 0, column 0"),
    ],
)
def test_a_request_fails_by_name_and_the_next_one_starts_anew(
    room: Room, behaviour: str, error: type[LippmannError], message: str
) -> None:
    with pytest.raises(error, match=message):
        room.ask(behaviour)
    until(lambda: not room.processes())
    assert room.ask().notes[0] == "served 0"


def test_channels_come_back_with_the_names_of_the_objects(room: Room) -> None:
    found = room.ask("channels", channels=("normal", "albedo", "object", "motion"))
    assert found.objects == ("fish", "water")
    assert found.pixels["normal"][0, 0].tolist() == pytest.approx([0.0, 0.6, 0.8])
    assert found.pixels["object"].tolist() == [[[2.0], [0.0]]]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ("normal 1.5", r"numbers from -1\.001 to 1\.001 as normal from Mitsuba, got nan, nan, 1\.5 at row 0, column 1"),
        ("albedo inf", "numbers from 0 to 1 as albedo from Mitsuba, got nan, nan, inf"),
        ("motion inf", "as motion from Mitsuba, got nan, nan, inf"),
        ("object 3", "whole numbers from 0 to 2 as object from Mitsuba, got 3"),
        ("object 0.5", r"whole numbers from 0 to 2 as object from Mitsuba, got 0\.5"),
        ("object nan", "whole numbers from 0 to 2 as object from Mitsuba, got nan"),
    ],
)
def test_numbers_that_no_channel_has_are_refused(room: Room, wrong: str, message: str) -> None:
    with pytest.raises(RenderFailed, match=message):
        room.ask(f"channels {wrong}", channels=("normal", "albedo", "object", "motion"))


def test_a_program_without_progress_has_stalled(room: Room) -> None:
    with pytest.raises(RenderStalled, match=r"no progress for 0\.5 s, the limit that stall gives; at 50 %"):
        room.ask("sleep", stall_s=0.5)


def test_a_program_is_ended_after_its_time(room: Room) -> None:
    with pytest.raises(RenderTimedOut, match=r"after 0\.5 s, the limit that total gives"):
        room.ask("sleep", total_s=0.5)


def test_a_program_is_ended_when_the_attempt_should_stop(room: Room) -> None:
    stop: list[float] = []
    with pytest.raises(Stopped):
        room.ask("sleep", on_progress=stop.append, should_stop=lambda: bool(stop))
    until(lambda: not room.processes())


def test_a_sandbox_that_does_not_start_is_named(room: Room) -> None:
    with pytest.raises(SandboxMissing):
        room.ask(key=replace(KEY, limits=replace(KEY.limits, file_mb=-(10**30))))
