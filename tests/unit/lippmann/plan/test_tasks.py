"""A job and its cost become tasks."""

from __future__ import annotations

from itertools import pairwise

import pytest

from lippmann.job.animation.clock import Clock
from lippmann.job.messages.events import ProbeResult
from lippmann.job.messages.orders import TaskKind
from lippmann.job.rendering.render_settings import Capture
from lippmann.job.resolved import StoredPlan
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.plan.cost import COMFORTABLE_PX, COMFORTABLE_S, WORTHWHILE_S, depth_s_per_px
from lippmann.plan.sampling import frame_size
from lippmann.plan.tasks import plan_sheet, plan_tasks, previews


def job(frames: str = "1-6", tiles: object = "auto") -> JobSpec:
    return parse_spec({"scene": "fish", "frames": frames, "render": {"tiles": tiles}})


def probed(frame_s: float, *, tileable: bool = True) -> ProbeResult:
    return ProbeResult(start_s=0.7, s_per_px=frame_s / frame_size(job().rig).px, tileable=tileable)


def test_every_frame_is_rendered_assembled_and_every_output_encoded() -> None:
    tasks = list(plan_tasks(job(), plan_sheet(job(), probed(6.0), slots=2)))
    assert [task.kind for task in tasks] == [TaskKind.RENDER, TaskKind.ASSEMBLE] * 6 + [TaskKind.ENCODE] * 3
    assert {task.frame for task in tasks if task.kind is TaskKind.RENDER} == {1, 2, 3, 4, 5, 6}
    assert {task.output for task in tasks} == {None, "views.mp4", "centre.mp4", "orthoscopic.mkv"}


def test_a_stage_that_is_needed_is_made() -> None:
    tasks = list(plan_tasks(job(), plan_sheet(job(), probed(600.0), slots=2)))
    assert {task.needs for task in tasks} - {None} <= {task.stage for task in tasks}


def test_tasks_have_each_their_own_sequence_and_artifact() -> None:
    tasks = list(plan_tasks(job(), plan_sheet(job(), probed(600.0), slots=2)))
    assert all(b.sequence == a.sequence + 1 for a, b in pairwise(tasks))
    assert len({task.artifact for task in tasks}) == len(tasks)


def test_the_first_the_middle_and_the_last_frame_come_before_the_others() -> None:
    tasks = list(plan_tasks(job("1-9"), plan_sheet(job("1-9"), probed(6.0), slots=2)))
    assembled = [task.frame for task in tasks if task.kind is TaskKind.ASSEMBLE]
    assert assembled == [1, 5, 9, 2, 3, 4, 6, 7, 8]
    assert [task.sequence for task in tasks] == list(range(1, len(tasks) + 1))


@pytest.mark.parametrize("frames", ["7", "7,9", "1-3", "1-4", "2-100:7"])
def test_every_frame_is_planned_once_whatever_comes_first(frames: str) -> None:
    tasks = plan_tasks(job(frames), plan_sheet(job(frames), probed(6.0), slots=2))
    assembled = [task.frame or 0 for task in tasks if task.kind is TaskKind.ASSEMBLE]
    assert sorted(assembled) == list(job(frames).frame_numbers)
    assert len(set(assembled)) == len(assembled)


@pytest.mark.parametrize(("frames", "repeat", "expected"), [("1-90", 45, (1, 23, 45)), ("31-80", 20, (31, 41, 50))])
def test_no_two_previews_of_a_motion_that_repeats_are_equal(
    frames: str, repeat: int, expected: tuple[int, ...]
) -> None:
    """The render cache cannot help frames that are rendered at the same time."""
    assert previews(job(frames).frame_numbers, Clock(repeat_frames=repeat)) == expected


def test_a_plan_of_an_earlier_release_goes_on_in_its_own_order() -> None:
    """Its first tasks may be in the database already."""
    stored = plan_sheet(job("1-9"), probed(6.0), slots=2).model_dump(exclude={"previews"})
    tasks = plan_tasks(job("1-9"), StoredPlan.model_validate(stored))
    assert [task.frame for task in tasks if task.kind is TaskKind.ASSEMBLE] == list(range(1, 10))


def test_no_tile_of_a_long_frame_is_longer_than_comfortable() -> None:
    sheet = plan_sheet(job("1-100"), probed(600.0), slots=2)
    assert 600.0 / (sheet.tile_rows * sheet.tile_cols) <= COMFORTABLE_S


def test_a_still_is_cut_for_all_slots_but_not_below_what_is_worthwhile() -> None:
    assert plan_sheet(job("1"), probed(100.0), slots=8).tile_rows == 16
    assert 12.0 / plan_sheet(job("1"), probed(12.0), slots=8).tile_rows >= WORTHWHILE_S


@pytest.mark.parametrize(("frames", "slots", "tiles"), [("1", 1, 1), ("1", 2, 4), ("1-2", 2, 1), ("1-3", 2, 2)])
def test_frames_are_cut_where_slots_would_not_end_together(frames: str, slots: int, tiles: int) -> None:
    assert plan_sheet(job(frames), probed(30.0), slots=slots).tile_rows == tiles


@pytest.mark.parametrize(
    ("frames", "frame_s", "slots", "idle_workers", "tiles"),
    [
        ("1", 30.0, 2, 1, 1),
        ("1-3", 30.0, 8, 1, 1),
        ("1-3", 30.0, 2, 1, 2),  # more frames than slots
        ("1", 30.0, 2, 2, 4),  # a task has the slots of one worker
        ("1", 30.0, 2, 0, 4),  # the slots have other work
        ("1", 130.0, 2, 1, 4),  # longer than comfortable in both slots
        ("1", 130.0, 64, 1, 26),  # more slots than a task has threads
    ],
)
def test_a_frame_that_threads_in_all_slots_of_a_worker_share_is_not_cut(
    frames: str, frame_s: float, slots: int, idle_workers: int, tiles: int
) -> None:
    probe = probed(frame_s).model_copy(update={"parallel": True})
    assert plan_sheet(job(frames), probe, slots=slots, idle_workers=idle_workers).tile_rows == tiles
    by_one_thread = plan_sheet(job(frames), probed(frame_s), slots=slots, idle_workers=idle_workers).tile_rows
    assert by_one_thread > 1


def test_a_short_frame_of_a_sequence_is_not_cut() -> None:
    sheet = plan_sheet(job(), probed(6.0), slots=2)
    assert (sheet.tile_rows, sheet.tile_cols) == (1, 1)


def test_a_large_tile_is_cut_for_memory_even_when_it_is_quick() -> None:
    rig = {"lens_array": {"count": [100, 100]}, "px_per_lens": 24}
    spec = parse_spec({"scene": "fish", "rig": rig, "capture": {"supersample": 2}})
    sheet = plan_sheet(spec, ProbeResult(start_s=0.7, s_per_px=1e-9, tileable=True), slots=1)
    assert 4 * 2400 * 2400 / sheet.tile_rows <= COMFORTABLE_PX


def test_a_second_picture_for_depth_is_reckoned_with() -> None:
    spec = job("1-100").model_copy(update={"capture": Capture(depth=True)})
    plain, twice = (plan_sheet(asked, probed(600.0), slots=2).tile_rows for asked in (job("1-100"), spec))
    assert twice >= 2 * plain
    # A supersampled one costs no more for it: one ray a pixel.
    finer = spec.model_copy(update={"capture": Capture(depth=True, supersample=8)})
    assert depth_s_per_px(finer, probed(600.0)) < depth_s_per_px(spec, probed(600.0)) / 30
    assert depth_s_per_px(job(), probed(600.0)) == 0


def test_antialiasing_that_leaves_seams_is_never_cut() -> None:
    spec = parse_spec({"scene": "fish", "render": {"antialias": {"method": 1}}})
    sheet = plan_sheet(spec, probed(600.0), slots=2)
    assert (sheet.tile_rows, sheet.tile_cols) == (1, 1)


@pytest.mark.parametrize("tiles", ["auto", [4, 4]])
def test_a_scene_whose_tiles_differ_from_the_whole_is_never_cut(tiles: object) -> None:
    sheet = plan_sheet(job("1", tiles), probed(600.0, tileable=False), slots=8)
    assert (sheet.tile_rows, sheet.tile_cols) == (1, 1)


def test_what_the_job_says_about_tiles_goes() -> None:
    sheet = plan_sheet(job("1", [3, 2]), probed(1.0), slots=1)
    tasks = list(plan_tasks(job("1", [3, 2]), sheet))
    assert sum(task.kind is TaskKind.RENDER for task in tasks) == 6


def test_a_frames_weight_is_its_pixels_however_it_is_cut() -> None:
    spec = job("1", [3, 2])
    tasks = plan_tasks(spec, plan_sheet(spec, probed(1.0), slots=1))
    assert sum(task.weight_px for task in tasks if task.kind is TaskKind.RENDER) == frame_size(spec.rig).px
