"""Pause, resume, cancel, retry and remove, and what they mean for tasks and attempts."""

from __future__ import annotations

from collections import Counter

import pytest

from lippmann.job.states import JobStatus, TaskStatus
from service.db import coordinator as coordinator_rows
from service.db import tasks as task_rows
from service.db.tables import BackgroundJob
from service.jobs.commands import cancel_job, pause_job, remove_job, resume_job, retry_job
from service.settings import FailureLimit
from tests.builders_service import Farm, claimed, done, failed

LIMIT = FailureLimit(share=0.1, least=3)


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let ten rows be a chunk."""
    monkeypatch.setattr(task_rows, "CHUNK", 10)


def _stops(farm: Farm) -> set[str]:
    with farm.database.reading() as session:
        return set(coordinator_rows.pending_stops(session))


def _pause(farm: Farm, job_id: str) -> None:
    with farm.writing() as session:
        pause_job(session, job_id, now_s=farm.now_s)


def _resume(farm: Farm, job_id: str) -> None:
    with farm.writing() as session:
        resume_job(session, job_id, now_s=farm.now_s, limit=LIMIT)


def _cancel(farm: Farm, job_id: str) -> None:
    with farm.writing() as session:
        cancel_job(session, job_id, now_s=farm.now_s)


def _retry(farm: Farm, job_id: str) -> None:
    with farm.writing() as session:
        retry_job(session, job_id, now_s=farm.now_s, limit=LIMIT)


def test_pause_takes_back_what_nobody_has_claimed_and_lets_what_runs_end(farm: Farm) -> None:
    job_id = farm.planned()
    running, *queued = farm.dispatch()
    farm.say(claimed(running))
    _pause(farm, job_id)
    assert _stops(farm) == {order.attempt for order in queued}
    farm.say(done(running))
    assert farm.task(running).status is TaskStatus.DONE
    assert (farm.job(job_id).status, farm.job(job_id).dispatched) == (JobStatus.PAUSED, 0)


def test_a_resumed_job_ends_with_every_frame_once(farm: Farm) -> None:
    job_id = farm.planned()
    farm.dispatch()
    _pause(farm, job_id)
    _resume(farm, job_id)
    farm.work()
    assert (farm.job(job_id).status, farm.job(job_id).frames_done) == (JobStatus.DONE, 3)


def test_a_job_paused_while_it_is_probed_is_planned_and_goes_on_when_resumed(farm: Farm) -> None:
    job_id = farm.submit()
    (order,) = farm.dispatch()
    farm.say(claimed(order))
    _pause(farm, job_id)
    farm.say(done(order))
    farm.plan()
    assert (farm.job(job_id).status, farm.job(job_id).ready) == (JobStatus.PAUSED, 6)
    assert farm.dispatch() == []
    _resume(farm, job_id)
    farm.work()
    assert farm.job(job_id).status is JobStatus.DONE


def test_a_job_whose_last_task_ended_while_it_was_paused_is_done_when_resumed(farm: Farm) -> None:
    job_id = farm.planned(frames="1", render={"tiles": [1, 1]}, outputs=[])
    (render,) = farm.dispatch()
    farm.say(done(render))
    (assemble,) = farm.dispatch()
    farm.say(claimed(assemble))
    _pause(farm, job_id)
    farm.say(done(assemble))
    assert farm.job(job_id).status is JobStatus.PAUSED
    _resume(farm, job_id)
    assert farm.job(job_id).status is JobStatus.DONE


def test_a_job_that_cannot_be_done_fails_when_resumed(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    _pause(farm, job_id)
    farm.say(failed(order, permanent=True))
    assert farm.job(job_id).status is JobStatus.PAUSED
    _resume(farm, job_id)
    assert farm.job(job_id).status is JobStatus.FAILED


def test_cancel_stops_what_is_held_and_leaves_nothing_to_do(farm: Farm) -> None:
    job_id = farm.planned()
    orders = farm.dispatch()
    farm.say(claimed(orders[0]), done(orders[0]), claimed(orders[1]))
    _cancel(farm, job_id)
    assert _stops(farm) == {order.attempt for order in orders[1:]}
    statuses = Counter(task.status for task in farm.tasks(job_id))
    assert statuses == {TaskStatus.DONE: 2, TaskStatus.CANCELLED: 9}
    assert farm.dispatch() == []


def test_a_cancelled_attempt_that_says_done_all_the_same_is_late(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    _cancel(farm, job_id)
    farm.say(done(order))
    assert (farm.task(order).status, farm.job(job_id).late_events) == (TaskStatus.CANCELLED, 1)


def test_a_cancelled_job_goes_on_with_only_what_is_not_done(farm: Farm) -> None:
    job_id = farm.planned()
    for order in farm.dispatch():
        farm.say(done(order))
    done_before = {task.sequence for task in farm.tasks(job_id) if task.status is TaskStatus.DONE}
    _cancel(farm, job_id)
    _retry(farm, job_id)
    ordered_before = len(farm.queue.orders)
    farm.work()
    ordered = {int(order.task_id.rpartition("-")[2]) for order in farm.queue.orders[ordered_before:]}
    assert farm.job(job_id).status is JobStatus.DONE
    assert not ordered & done_before


def test_retry_makes_ready_what_needs_nothing_and_lets_the_rest_wait(farm: Farm) -> None:
    job_id = farm.planned()
    _cancel(farm, job_id)
    _retry(farm, job_id)
    for task in farm.tasks(job_id)[1:]:
        assert task.status is (TaskStatus.WAITING if task.needs else TaskStatus.READY)


def test_retry_forgives_failures(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(failed(order, permanent=True))
    _retry(farm, job_id)
    task = farm.task(order)
    assert (task.status, task.failures, task.failed_on, task.error_code, task.permanent) == (
        TaskStatus.READY, 0, [], None, False,
    )  # fmt: skip
    assert farm.job(job_id).error_code is None
    farm.work()
    assert farm.job(job_id).status is JobStatus.DONE


def test_a_job_whose_probe_failed_is_probed_again_by_retry(farm: Farm) -> None:
    job_id = farm.submit()
    (order,) = farm.dispatch()
    farm.say(failed(order, permanent=True))
    assert farm.job(job_id).status is JobStatus.FAILED
    _retry(farm, job_id)
    (order,) = farm.dispatch()
    farm.say(done(order))
    farm.plan()
    farm.work()
    assert farm.job(job_id).status is JobStatus.DONE


def test_a_job_cancelled_in_the_middle_of_planning_is_planned_to_the_end_by_retry(
    farm: Farm, small_chunks: None
) -> None:
    job_id = farm.submit(frames="1-5")  # 16 tasks after the probe: more than a chunk
    (order,) = farm.dispatch()
    farm.say(done(order))
    farm.background_jobs.run_round(slots=2, now_s=farm.now_s)  # decides
    farm.background_jobs.run_round(slots=2, now_s=farm.now_s)  # the first chunk
    assert len(farm.tasks(job_id)) == 1 + task_rows.CHUNK
    _cancel(farm, job_id)
    farm.plan()
    _retry(farm, job_id)
    farm.plan()
    job = farm.job(job_id)
    assert (len(farm.tasks(job_id)), job.status, job.background_job) == (17, JobStatus.RUNNING, None)
    farm.work()
    assert (farm.job(job_id).status, farm.job(job_id).frames_done) == (JobStatus.DONE, 5)


def test_a_long_job_is_cancelled_in_pieces_of_a_chunk(farm: Farm, small_chunks: None) -> None:
    job_id = farm.planned(frames="1-9")  # 28 tasks after the probe
    _cancel(farm, job_id)
    pieces = [farm.job(job_id).cancelled]
    while farm.background_jobs.run_round(slots=2, now_s=farm.now_s):
        pieces.append(farm.job(job_id).cancelled)
    pieces.append(farm.job(job_id).cancelled)
    assert pieces == [10, 20, 28]
    assert farm.job(job_id).background_job is None


def test_a_job_retried_while_it_is_still_being_cancelled_comes_back_whole(farm: Farm, small_chunks: None) -> None:
    job_id = farm.planned(frames="1-9")
    _cancel(farm, job_id)
    _retry(farm, job_id)
    farm.plan()
    job = farm.job(job_id)
    assert (job.ready, job.waiting, job.cancelled, job.background_job) == (18, 10, 0, None)


def test_a_removed_job_is_gone_with_its_artifacts_and_nothing_else(farm: Farm) -> None:
    kept, gone = farm.planned_jobs(2)
    for job_id in (kept, gone):
        _cancel(farm, job_id)
    with farm.writing() as session:
        remove_job(session, gone)
    assert farm.job(gone).background_job is BackgroundJob.REMOVE
    farm.plan()
    assert not [name for name in farm.store.files if name.startswith(gone)]
    assert [name for name in farm.store.files if name.startswith(kept)]
    assert (farm.tasks(gone), len(farm.tasks(kept))) == ([], 11)
