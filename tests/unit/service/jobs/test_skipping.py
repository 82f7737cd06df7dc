"""Skipped frames: a job is done without them, nothing waits for them, and a retry brings them back."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import pytest

from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.states import FrameStatus, JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from service.db.tables import JobEvent
from service.doctor.examine import Patient, examine
from tests.builders_service import Client, Farm, claimed, done, failed

R, A, E = TaskKind.RENDER, TaskKind.ASSEMBLE, TaskKind.ENCODE


def work_except(farm: Farm, *, frame: int, kind: TaskKind = R) -> list[Order]:
    """Do all work; the tasks of one kind of a frame fail permanently. Return the orders of outputs."""
    outputs: list[Order] = []
    while orders := farm.dispatch():
        for order in orders:
            is_bad = (order.kind, order.frame) == (kind, frame)
            farm.say(claimed(order), failed(order, permanent=True) if is_bad else done(order))
            outputs += [order] if order.kind is E else []
        farm.plan()
    return outputs


def statuses(farm: Farm, job_id: str, frame: int) -> Counter[tuple[TaskKind, TaskStatus]]:
    return Counter((task.kind, task.status) for task in farm.tasks(job_id) if task.frame == frame)


def skip(api: Client, job_id: str, frames: Sequence[int] | None = None) -> Any:
    answer = api.post(f"/api/v1/jobs/{job_id}/skip", json=None if frames is None else {"frames": frames})
    assert answer.status_code == 200, answer.text
    return answer.json()


def findings(farm: Farm) -> list[str]:
    """Return what the doctor finds in the rows; the store of these tests holds no artifacts."""
    patient = Patient(farm.database, farm.store, farm.settings)
    return [each.message for each in examine(patient, now_s=farm.now_s) if each.check not in ("artifacts", "settings")]


@pytest.mark.parametrize("kind", [R, A])
def test_a_failed_job_ends_as_done_without_the_frame_that_failed(api: Client, api_farm: Farm, kind: TaskKind) -> None:
    job_id = api_farm.planned(outputs=["views.mp4", "view_grid.png"])
    assert work_except(api_farm, frame=2, kind=kind) == []
    assert api_farm.job(job_id).status is JobStatus.FAILED
    shown = skip(api, job_id)
    assert (shown["status"], shown["skipped_frames"], shown["error"]) == ("running", [2], None)
    outputs = work_except(api_farm, frame=0)
    assert [order.skipped_frames for order in outputs] == [(2,), (2,)]
    job = api.get(f"/api/v1/jobs/{job_id}").json()
    assert (job["status"], job["frames_done"], job["skipped_frames"], job["progress"]) == ("done", 2, [2], 1.0)
    assert (job["tasks"]["failed"], job["tasks"]["waiting"], job["tasks"]["ready"]) == (0, 0, 0)
    assert statuses(api_farm, job_id, 2)[A, TaskStatus.SKIPPED] == 1
    frames = api.get(f"/api/v1/jobs/{job_id}/frames").json()["items"]
    assert [frame["status"] for frame in frames] == ["done", "skipped", "done"]
    assert (api_farm.job(job_id).done_px, findings(api_farm)) == (api_farm.job(job_id).total_px, [])


def test_the_frames_of_a_cancelled_job_are_skipped_by_name_and_the_others_are_made(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned()
    first, *_ = api_farm.dispatch()
    api_farm.say(claimed(first), done(first))
    api.post(f"/api/v1/jobs/{job_id}/cancel")
    assert skip(api, job_id, [1, 3])["skipped_frames"] == [1, 3]
    # The tile that was done stays done.
    assert statuses(api_farm, job_id, 1) == {
        (R, TaskStatus.DONE): 1,
        (R, TaskStatus.SKIPPED): 1,
        (A, TaskStatus.SKIPPED): 1,
    }
    (output,) = work_except(api_farm, frame=0)
    assert output.skipped_frames == (1, 3)
    assert (api_farm.job(job_id).status, api_farm.job(job_id).frames_done) == (JobStatus.DONE, 1)
    assert findings(api_farm) == []


def test_a_job_without_outputs_is_done_at_once_when_its_last_frame_is_skipped(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned(outputs=[])
    work_except(api_farm, frame=3)
    while api_farm.job(job_id).frames_done < 2:  # what was ready when the job failed
        api.post(f"/api/v1/jobs/{job_id}/retry")
        work_except(api_farm, frame=3)
    assert skip(api, job_id)["status"] == "done"


def test_a_retry_beyond_a_quota_deletes_nothing(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    farm = make_farm(coordinator=False, redis_url="redis://127.0.0.1:1/0", max_open_jobs=1)
    api, job_id = make_client(farm), farm.planned()
    work_except(farm, frame=2)
    skip(api, job_id)
    work_except(farm, frame=0)
    video = f"{job_id}/video/views.mp4"
    farm.store.files[video] = b"without frame 2"
    farm.submit()
    assert api.post(f"/api/v1/jobs/{job_id}/retry").status_code == 429
    assert (farm.job(job_id).status, farm.store.files[video]) == (JobStatus.DONE, b"without frame 2")


def test_a_retry_brings_skipped_frames_back_and_makes_the_outputs_again(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned(outputs=["views.mp4", "view_grid.png"])
    work_except(api_farm, frame=2)
    skip(api, job_id)
    work_except(api_farm, frame=0)
    before = api_farm.job(job_id)
    stale = ["video/views.mp4", "video/views.mp4.json", "exports/view_grid.png.json", "exports/view_grid/0001.png"]
    for name in stale:
        api_farm.store.put_bytes(names.job_artifact(job_id, name), b"without frame 2")
    answer = api.post(f"/api/v1/jobs/{job_id}/retry").json()
    assert (answer["status"], answer["skipped_frames"], answer["tasks"]["skipped"]) == ("running", [], 0)
    assert not any(api_farm.store.exists(names.job_artifact(job_id, name)) for name in stale)
    assert {task.status for task in api_farm.tasks(job_id) if task.kind is E} == {TaskStatus.WAITING}
    assert answer["progress"] < 1
    assert findings(api_farm) == []
    outputs = work_except(api_farm, frame=0)
    assert [order.skipped_frames for order in outputs] == [(), ()]
    job = api_farm.job(job_id)
    assert (job.status, job.frames_done, job.skipped) == (JobStatus.DONE, 3, 0)
    assert (job.done_px, job.total_px > before.total_px, findings(api_farm)) == (job.total_px, True, [])


def test_repair_leaves_skipped_frames_out(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned()
    work_except(api_farm, frame=2)
    skip(api, job_id)
    work_except(api_farm, frame=0)
    api.post(f"/api/v1/jobs/{job_id}/repair")
    api_farm.repair()
    api_farm.plan()
    api_farm.work()
    assert api_farm.job(job_id).status is JobStatus.DONE
    assert api.get(f"/api/v1/jobs/{job_id}").json()["skipped_frames"] == [2]


def test_what_is_skipped_is_published(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned()
    work_except(api_farm, frame=2)
    skip(api, job_id)
    with api_farm.database.reading() as session:
        said = session.query(JobEvent).filter(JobEvent.job_id == job_id).order_by(JobEvent.id).all()
    frames = [each.data for each in said if each.topic == "frame"]
    jobs = [each.data for each in said if each.topic == "job"]
    assert frames[-1] == {"job": job_id, "frame": 2, "status": FrameStatus.SKIPPED}
    assert jobs[-1]["skipped_frames"] == [2]


@pytest.mark.parametrize(
    ("frames", "status", "words"),
    [
        ([7], 422, "frames of the job"),
        ([1, 2, 3], 409, "at least one must be left"),
        (None, 409, "none has failed"),
        ([], 422, "frames"),
    ],
)
def test_what_cannot_be_skipped_is_refused_with_the_reason(
    api: Client, api_farm: Farm, frames: list[int] | None, status: int, words: str
) -> None:
    job_id = api_farm.planned()
    api.post(f"/api/v1/jobs/{job_id}/cancel")
    answer = api.post(f"/api/v1/jobs/{job_id}/skip", json={"frames": frames})
    assert answer.status_code == status
    assert words in answer.text
    assert api_farm.job(job_id).status is JobStatus.CANCELLED


def test_a_frame_that_is_done_is_not_skipped_and_neither_is_one_of_a_job_without_a_plan(
    api: Client, api_farm: Farm
) -> None:
    job_id = api_farm.planned()
    while api_farm.job(job_id).frames_done == 0:
        for order in api_farm.dispatch():
            api_farm.say(claimed(order), done(order))
    api.post(f"/api/v1/jobs/{job_id}/cancel")
    assert "frame 1: it is done" in api.post(f"/api/v1/jobs/{job_id}/skip", json={"frames": [1]}).json()["detail"]
    young = api_farm.submit()
    api.post(f"/api/v1/jobs/{young}/cancel")
    assert "not planned" in api.post(f"/api/v1/jobs/{young}/skip", json={"frames": [1]}).json()["detail"]
