"""The clock of an animation by the options that its .ini has."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from lippmann.errors import BundleError, SpecError
from lippmann.job.animation.clock import Clock
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.spec import parse_spec

STAGE = {"location": [0, 0, -1000], "look_at": [0, 0, 0], "near_mm": 900, "far_mm": 2000}


def test_the_clock_runs_from_first_to_last() -> None:
    clock = Clock(first=2.0, last=5.0, frames=4)
    assert [clock.at(frame) for frame in range(1, 5)] == [2.0, 3.0, 4.0, 5.0]


def test_a_cyclic_clock_is_complete_after_its_last_frame() -> None:
    clock = Clock(last=1.0, frames=4, cyclic=True)
    assert [clock.at(frame) for frame in range(1, 5)] == [0.0, 0.25, 0.5, 0.75]
    assert clock.variables(4)["final_frame"] == 5.0


def test_a_clock_that_was_stored_is_the_same() -> None:
    clock = Clock(last=1.0, frames=30)
    assert Clock.model_validate_json(clock.model_dump_json()) == clock


def test_frames_that_repeat_have_the_variables_of_the_first_turn() -> None:
    clock = Clock(repeat_frames=5, frames=40)
    assert (clock.at(7), clock.variables(7)) == (clock.at(2), clock.variables(2))


@pytest.mark.parametrize(
    ("clock", "field"),
    [
        ({"last": 1.0}, "clock.frames: expected 2 frames or more from first to last, got None"),
        ({"last": 1.0, "frames": 1}, "clock.frames: expected 2 frames or more"),
        ({"last": 1.0, "frames": 5, "per_frame": 1.0}, "clock.per_frame: expected per_frame, or last and frames"),
        ({"cyclic": True, "frames": 4}, "clock.last: expected the clock at which a cyclic animation is complete"),
        ({"last": "end", "frames": 4}, "clock.last"),
    ],
)
def test_a_clock_that_says_too_little_or_too_much_is_refused(clock: dict[str, Any], field: str) -> None:
    with pytest.raises(BundleError, match=field):
        parse_scene({"stage": STAGE, "clock": clock})


def test_the_least_cyclic_animation_has_one_frame() -> None:
    assert Clock(last=1.0, frames=1, cyclic=True).at(1) == 0.0
    with pytest.raises(ValidationError):
        Clock(last=1.0, frames=0, cyclic=True)


@pytest.mark.parametrize(
    ("scene_clock", "frames", "final"),
    [({}, None, 8), ({"frames": 30}, None, 30), ({}, 20, 20), ({"frames": 30}, 20, 30)],
)
def test_the_last_frame_is_that_of_the_animation_or_else_of_the_job(
    scene_clock: dict[str, Any], frames: int | None, final: int
) -> None:
    scene = parse_scene({"stage": STAGE, "clock": scene_clock})
    job = ResolvedJob.of("j", parse_spec({"scene": "own", "frames": "3, 8"}), scene, bundle="b" * 64, frames=frames)
    assert job.clock.variables(3)["final_frame"] == final


@pytest.mark.parametrize("field", ["first", "last", "frames"])
def test_a_number_beyond_all_bounds_is_a_problem_of_its_field(field: str) -> None:
    clock = {"first": 0, "last": 1, "frames": 3} | {field: 10**400}
    with pytest.raises(SpecError) as refused:
        parse_spec({"scene": "own", "clock": clock})
    assert f"clock.{field}" in {problem.field for problem in refused.value.problems}
