"""A retry of a job whose artifacts went away or were damaged makes exactly those again."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from lippmann.job.messages.events import Failure
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from service.db.counters import recount
from service.jobs.artifact_repair import repair_artifacts
from tests.builders_service import Client, Farm, claimed, done, failed

MASTERS = (
    names.integral_name,
    names.orthoscopic_name,
    names.depth_name,
    names.device_name,
    names.views_name,
    names.thumb_name,
)


def _make(farm: Farm, order: Order) -> None:
    """Store what an order asks for, as a worker does: what is there already is not made again."""
    artifact = names.job_artifact(order.job_id, farm.task(order).artifact)
    if artifact in farm.store.files:
        return
    made = [name(order.frame or 0) for name in MASTERS] if order.kind is TaskKind.ASSEMBLE else []
    if order.kind is TaskKind.RENDER and order.tile is not None:
        made.append(names.depth_tile_name(order.frame or 0, order.tile))
    for name in [artifact, *(names.job_artifact(order.job_id, name) for name in made)]:
        farm.store.files[name] = b"whole"


def _work(farm: Farm, fails: Callable[[Order], str | None] = lambda _: None, *, frame: int | None = None) -> None:
    """Do every order; `fails` returns the code with which an order fails, and `frame` is in the failure."""
    for _ in range(60):
        farm.now_s += 10
        for order in farm.dispatch():
            code = fails(order)
            if code is None:
                _make(farm, order)
            farm.say(claimed(order), failed(order, code=code, frame=frame) if code else done(order))
        farm.repair()


def _frame_two_fails(code: str) -> Callable[[Order], str | None]:
    return lambda order: code if (order.kind, order.frame) == (TaskKind.ASSEMBLE, 2) else None


def _encode_fails(code: str) -> Callable[[Order], str | None]:
    return lambda order: code if order.kind is TaskKind.ENCODE else None


def _statuses(farm: Farm, job_id: str, kind: TaskKind) -> dict[int | None, set[TaskStatus]]:
    tasks = [task for task in farm.tasks(job_id) if task.kind is kind]
    return {task.frame: {other.status for other in tasks if other.frame == task.frame} for task in tasks}


def _tiles(farm: Farm, job_id: str, frame: int) -> list[str]:
    return [name for name in farm.store.files if name.startswith(f"{job_id}/tiles/{frame:04d}/")]


@pytest.fixture
def job_id(api_farm: Farm) -> str:
    return api_farm.planned()


def _is_counted_right(farm: Farm, job_id: str) -> None:
    with farm.writing() as session:
        assert recount(session, job_id) is False
    done_tasks = [task for task in farm.tasks(job_id) if task.status is TaskStatus.DONE]
    row = farm.job(job_id)
    assert row.done_px == sum(task.weight_px for task in done_tasks)
    assert row.frames_done == sum(task.kind is TaskKind.ASSEMBLE for task in done_tasks)
    assert row.wall_s == pytest.approx(sum(task.wall_s or 0.0 for task in done_tasks))


def test_the_tiles_of_a_damaged_frame_are_deleted_and_rendered_again(api: Client, api_farm: Farm, job_id: str) -> None:
    _work(api_farm, _frame_two_fails("artifact-broken"))
    assert api_farm.job(job_id).status is JobStatus.FAILED
    assert len(_tiles(api_farm, job_id, 2)) == 2
    assert api.post(f"/api/v1/jobs/{job_id}/retry").status_code == 200
    assert _tiles(api_farm, job_id, 2) == []
    renders = _statuses(api_farm, job_id, TaskKind.RENDER)
    assert renders == {1: {TaskStatus.DONE}, 2: {TaskStatus.READY}, 3: {TaskStatus.DONE}}
    assert _statuses(api_farm, job_id, TaskKind.ASSEMBLE)[2] == {TaskStatus.WAITING}
    _is_counted_right(api_farm, job_id)
    _work(api_farm)
    assert (api_farm.job(job_id).status, api_farm.job(job_id).frames_done) == (JobStatus.DONE, 3)
    assert len(_tiles(api_farm, job_id, 2)) == 2
    _is_counted_right(api_farm, job_id)


def test_of_a_frame_that_lacks_a_tile_only_that_tile_is_rendered_again(
    api: Client, api_farm: Farm, job_id: str
) -> None:
    _work(api_farm, _frame_two_fails("artifact-missing"))
    kept, lost = _tiles(api_farm, job_id, 2)
    del api_farm.store.files[lost]
    api.post(f"/api/v1/jobs/{job_id}/retry")
    again = [task.artifact for task in api_farm.tasks(job_id) if task.status is TaskStatus.READY]
    assert [f"{job_id}/{name}" for name in again] == [lost]
    assert kept in api_farm.store.files
    _work(api_farm)
    assert api_farm.job(job_id).status is JobStatus.DONE


def test_a_video_that_finds_a_master_missing_has_its_frame_assembled_again(
    api: Client, api_farm: Farm, job_id: str
) -> None:
    _work(api_farm, _encode_fails("artifact-missing"))
    del api_farm.store.files[f"{job_id}/views/0003.exr"]
    (tile, _) = _tiles(api_farm, job_id, 3)
    del api_farm.store.files[tile]
    api.post(f"/api/v1/jobs/{job_id}/retry")
    assert f"{job_id}/thumbs/0003.webp" not in api_farm.store.files
    assert _statuses(api_farm, job_id, TaskKind.ASSEMBLE) == {
        1: {TaskStatus.DONE}, 2: {TaskStatus.DONE}, 3: {TaskStatus.WAITING},
    }  # fmt: skip
    assert _statuses(api_farm, job_id, TaskKind.ENCODE)[None] == {TaskStatus.WAITING}
    _is_counted_right(api_farm, job_id)
    _work(api_farm)
    assert api_farm.job(job_id).status is JobStatus.DONE
    assert {tile, f"{job_id}/views/0003.exr"} <= set(api_farm.store.files)


@pytest.mark.parametrize("lost", ["depth/0003.exr", "device/0003.exr"])
def test_depth_and_the_sheet_on_a_device_are_masters_too_if_the_job_has_them(
    api: Client, api_farm: Farm, lost: str
) -> None:
    rig = {"lens_array": {"count": [10, 10]}, "device": {"dpi": 600}}
    job_id = api_farm.planned(capture={"depth": True}, rig=rig)
    _work(api_farm, _encode_fails("artifact-missing"))
    del api_farm.store.files[f"{job_id}/{lost}"]
    api.post(f"/api/v1/jobs/{job_id}/retry")
    assert _statuses(api_farm, job_id, TaskKind.ASSEMBLE) == {
        1: {TaskStatus.DONE}, 2: {TaskStatus.DONE}, 3: {TaskStatus.READY},
    }  # fmt: skip
    _work(api_farm)
    assert api_farm.job(job_id).status is JobStatus.DONE
    assert f"{job_id}/{lost}" in api_farm.store.files


def test_a_tile_whose_depth_went_away_is_rendered_again(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned(capture={"depth": True})
    _work(api_farm, _frame_two_fails("artifact-missing"))
    lost = f"{job_id}/depth-tiles/0002/01-00.exr"
    del api_farm.store.files[lost]
    api.post(f"/api/v1/jobs/{job_id}/retry")
    again = [task.artifact for task in api_farm.tasks(job_id) if task.status is TaskStatus.READY]
    assert again == ["tiles/0002/01-00.exr"]
    _work(api_farm)
    assert api_farm.job(job_id).status is JobStatus.DONE
    assert lost in api_farm.store.files


@pytest.mark.parametrize("code", ["artifact-broken", "artifact-missing"])
def test_an_output_whose_failure_names_a_frame_has_only_that_frame_assembled_again(
    api: Client, api_farm: Farm, job_id: str, code: str
) -> None:
    _work(api_farm, _encode_fails(code), frame=2)
    if code == "artifact-missing":
        del api_farm.store.files[f"{job_id}/orthoscopic/0002.exr"]
    api.post(f"/api/v1/jobs/{job_id}/retry")
    assert _statuses(api_farm, job_id, TaskKind.ASSEMBLE) == {
        1: {TaskStatus.DONE}, 2: {TaskStatus.READY}, 3: {TaskStatus.DONE},
    }  # fmt: skip
    assert f"{job_id}/thumbs/0002.webp" not in api_farm.store.files
    assert f"{job_id}/thumbs/0001.webp" in api_farm.store.files
    _work(api_farm)
    assert api_farm.job(job_id).status is JobStatus.DONE
    assert {task.error_frame for task in api_farm.tasks(job_id)} == {None}


def test_a_failure_of_an_older_worker_that_names_no_frame_is_read() -> None:
    old = '{"code": "artifact-broken", "message": "0002.exr: not whole", "permanent": false}'
    assert Failure.model_validate_json(old).frame is None


def test_a_video_that_finds_a_master_damaged_and_does_not_say_which_has_all_frames_assembled_again(
    api: Client, api_farm: Farm, job_id: str
) -> None:
    _work(api_farm, _encode_fails("artifact-broken"))
    api.post(f"/api/v1/jobs/{job_id}/retry")
    assert set(_statuses(api_farm, job_id, TaskKind.ASSEMBLE)) == {1, 2, 3}
    assert {task.status for task in api_farm.tasks(job_id) if task.kind is TaskKind.ASSEMBLE} == {TaskStatus.READY}
    assert {task.status for task in api_farm.tasks(job_id) if task.kind is TaskKind.RENDER} == {TaskStatus.DONE}


def test_a_video_that_is_ready_waits_again_while_its_frames_are_made_again(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned(outputs=["views.mp4", "centre.mp4"])
    first = [True]

    def fails(order: Order) -> str | None:
        return "artifact-missing" if order.kind is TaskKind.ENCODE and (first or order.output == "views.mp4") else None

    _work(api_farm, fails)
    del api_farm.store.files[f"{job_id}/views/0001.exr"]
    api.post(f"/api/v1/jobs/{job_id}/retry")
    assert _statuses(api_farm, job_id, TaskKind.ENCODE)[None] == {TaskStatus.WAITING}


def test_a_retry_after_any_other_failure_does_no_work_twice(api: Client, api_farm: Farm, job_id: str) -> None:
    _work(api_farm, _frame_two_fails("store-unavailable"))
    before = dict(api_farm.store.files)
    api.post(f"/api/v1/jobs/{job_id}/retry")
    assert api_farm.store.files == before
    assert {task.status for task in api_farm.tasks(job_id) if task.kind is TaskKind.RENDER} == {TaskStatus.DONE}


def test_a_job_that_goes_on_is_not_repaired(api: Client, api_farm: Farm, job_id: str) -> None:
    _work(api_farm, _frame_two_fails("artifact-broken"))
    api.post(f"/api/v1/jobs/{job_id}/retry")
    _work(api_farm)
    before = dict(api_farm.store.files)
    assert repair_artifacts(api_farm.database, api_farm.store, job_id) == 0
    assert api.post(f"/api/v1/jobs/{job_id}/retry").status_code == 409
    assert api_farm.store.files == before
