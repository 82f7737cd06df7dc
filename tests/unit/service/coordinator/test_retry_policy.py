"""What failures mean for a task, for its job, and for the worker."""

from __future__ import annotations

from typing import Any

import pytest

from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from service.coordinator.retry_policy import DETERMINISTIC, INFRASTRUCTURE, LONGEST_PAUSE_S
from service.jobs.commands import retry_job
from tests.builders_service import Farm, claimed, done, failed, presence

MANY: dict[str, Any] = {"frames": "1-20", "outputs": []}


def _again(farm: Farm, task_id: str) -> Order:
    """Return the task's next order, however long its rest."""
    farm.now_s += 60
    return next(order for order in farm.dispatch() if order.task_id == task_id)


def test_a_permanent_failure_fails_the_job_at_once_with_its_message(farm: Farm) -> None:
    job_id = farm.planned()
    first, second, *_ = farm.dispatch()
    farm.say(claimed(first), claimed(second), failed(first, code="scene", permanent=True))
    job = farm.job(job_id)
    assert (job.status, job.error_code, job.error_message) == (JobStatus.FAILED, "scene", "scene happened")
    assert farm.task(first).status is TaskStatus.FAILED
    assert farm.dispatch() == []


def test_an_output_that_cannot_be_made_keeps_no_other_from_being_made(farm: Farm) -> None:
    job_id = farm.planned(frames="1", outputs=["views.mp4", "centre.mp4", "orthoscopic.mkv"])
    while (orders := farm.dispatch()) and orders[0].kind is not TaskKind.ENCODE:
        farm.say(*(said for order in orders for said in (claimed(order), done(order))))
    bad, *others = orders
    farm.say(claimed(bad), failed(bad, code="output", permanent=True))
    assert farm.job(job_id).status is JobStatus.RUNNING
    for order in (*others, *farm.dispatch()):
        farm.say(claimed(order), done(order))
    job = farm.job(job_id)
    assert (job.status, job.error_code, job.failed) == (JobStatus.FAILED, "tasks-failed", 1)
    assert job.error_message == "1 of 7 tasks failed; the first: views.mp4: output happened"


def test_outputs_that_fail_are_no_part_of_the_tenth_that_ends_a_job_and_a_retry_makes_them_alone(farm: Farm) -> None:
    farm.settings = farm.settings.model_copy(update={"failures_allowed": 1})
    outputs = [{"kind": "quilt", "name": f"q{number}"} for number in range(12)]
    job_id = farm.planned(frames="1", outputs=outputs)
    while (orders := farm.dispatch()) and orders[0].kind is not TaskKind.ENCODE:
        farm.say(*(said for order in orders for said in (claimed(order), done(order))))
    while orders:
        for order in orders:
            farm.say(claimed(order), done(order) if order.output == "q7.png" else failed(order, code="unexpected"))
        orders = farm.dispatch()
    job = farm.job(job_id)
    assert (job.status, job.failed, job.done) == (JobStatus.FAILED, 11, 5)
    with farm.writing() as session:
        retry_job(session, job_id, now_s=farm.now_s, limit=farm.settings.failure_limit)
    assert (farm.job(job_id).ready, farm.job(job_id).done) == (11, 5)
    farm.work()
    assert farm.job(job_id).status is JobStatus.DONE


def test_what_runs_is_told_to_stop_when_its_job_fails(farm: Farm) -> None:
    farm.planned()
    first, second, *_ = farm.dispatch()
    farm.say(claimed(first), claimed(second), failed(first, permanent=True))
    with farm.database.reading() as session:
        from service.db.coordinator import pending_stops

        assert second.attempt in pending_stops(session)
        assert first.attempt not in pending_stops(session)
    assert farm.task(second).status is TaskStatus.READY


def test_a_transient_failure_goes_back_with_a_rest_and_avoids_the_worker(farm: Farm) -> None:
    farm.workers = [presence("w1"), presence("w2")]
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order, "w1"), failed(order, "w1"))
    task = farm.task(order)
    assert (task.status, task.failures, task.failed_on) == (TaskStatus.READY, 1, ["w1"])
    assert task.not_before_s == farm.now_s + farm.settings.retry_pause_s
    assert order.task_id not in [other.task_id for other in farm.dispatch()]
    assert _again(farm, order.task_id).avoid == ("w1",)


def test_the_second_failure_of_a_task_delays_it_twice_as_long(farm: Farm) -> None:
    farm.planned(**MANY)
    order, *_ = farm.dispatch()
    farm.say(claimed(order), failed(order))
    again = _again(farm, order.task_id)
    assert (order.attempt_number, again.attempt_number) == (1, 2)
    farm.say(claimed(again), failed(again))
    assert farm.task(again).not_before_s == farm.now_s + 2 * farm.settings.retry_pause_s


def test_three_failures_end_a_task_and_not_two(farm: Farm) -> None:
    job_id = farm.planned(**MANY)
    order, *_ = farm.dispatch()
    for failures in (1, 2, 3):
        farm.say(claimed(order, f"w{failures}"), failed(order, f"w{failures}"))
        assert (farm.task(order).failures, farm.task(order).status) == (
            failures, TaskStatus.FAILED if failures == 3 else TaskStatus.READY,
        )  # fmt: skip
        if failures < 3:
            order = _again(farm, order.task_id)
    assert farm.job(job_id).status is JobStatus.RUNNING


def test_the_same_limit_twice_in_a_row_is_permanent(farm: Farm) -> None:
    job_id = farm.planned(**MANY)
    order, *_ = farm.dispatch()
    for code in ("parse-timeout", "out-of-memory"):
        farm.say(claimed(order), failed(order, code=code))
        assert farm.task(order).status is TaskStatus.READY
        order = _again(farm, order.task_id)
    farm.say(claimed(order), failed(order, code="out-of-memory"))
    task, job = farm.task(order), farm.job(job_id)
    assert (task.status, task.permanent, task.failures) == (TaskStatus.FAILED, True, 3)
    assert (job.status, job.error_code) == (JobStatus.FAILED, "out-of-memory")


def test_an_endless_scene_costs_two_timeouts_whatever_it_prints(farm: Farm) -> None:
    farm.planned(**MANY)
    order, *_ = farm.dispatch()
    farm.say(claimed(order), failed(order, code="render-stalled"))
    order = _again(farm, order.task_id)
    farm.say(claimed(order), failed(order, code="parse-timeout"))
    assert (farm.task(order).status, farm.task(order).permanent) == (TaskStatus.FAILED, True)


@pytest.mark.parametrize("code", sorted(DETERMINISTIC))
def test_each_limit_of_a_job_ends_a_task_at_the_second_time(farm: Farm, code: str) -> None:
    farm.planned(**MANY)
    order, *_ = farm.dispatch()
    farm.say(claimed(order), failed(order, code=code))
    order = _again(farm, order.task_id)
    farm.say(claimed(order), failed(order, code=code))
    assert (farm.task(order).status, farm.task(order).permanent) == (TaskStatus.FAILED, True)


def test_a_probe_that_reaches_its_limit_twice_fails_the_job_with_the_limit(farm: Farm) -> None:
    job_id = farm.submit(**MANY)
    for _ in range(2):
        farm.now_s += 60
        (order,) = farm.dispatch()
        farm.say(claimed(order), failed(order, code="parse-timeout"))
    job = farm.job(job_id)
    assert (job.status, job.error_code, job.error_message) == (
        JobStatus.FAILED, "parse-timeout", "parse-timeout happened",
    )  # fmt: skip


def test_a_job_with_one_failed_task_of_many_goes_on_and_fails_when_nothing_can_go_on(farm: Farm) -> None:
    job_id = farm.planned(**MANY)
    orders = farm.dispatch()
    bad = orders[0]
    for order in orders[1:]:
        farm.say(done(order))
    for _ in range(2):
        farm.say(failed(bad))
        bad = _again(farm, bad.task_id)
    farm.say(failed(bad))
    assert farm.job(job_id).status is JobStatus.RUNNING
    farm.now_s += 60
    for order in farm.queue.orders:
        if farm.task(order).attempt == order.attempt:
            farm.say(done(order))
    farm.work()
    job = farm.job(job_id)
    assert (job.status, job.error_code, job.frames_done) == (JobStatus.FAILED, "tasks-failed", 19)
    assert "render-failed happened" in (job.error_message or "")


@pytest.mark.parametrize(("failures", "status"), [(6, JobStatus.RUNNING), (7, JobStatus.FAILED)])
def test_more_than_a_tenth_of_failed_tasks_ends_a_job_and_a_tenth_does_not(
    farm: Farm, failures: int, status: JobStatus
) -> None:
    farm.workers = [presence(slots=100)]
    farm.settings = farm.settings.model_copy(update={"failures_allowed": 1})
    job_id = farm.planned(**MANY)  # 1 + 20 x (2 + 1) = 61 tasks
    for order in farm.dispatch()[:failures]:
        farm.say(failed(order))
    assert farm.job(job_id).status is status


def test_a_failed_probe_fails_the_job(farm: Farm) -> None:
    job_id = farm.submit()
    (order,) = farm.dispatch()
    for _ in range(2):
        farm.say(failed(order))
        order = _again(farm, order.task_id)
    farm.say(failed(order))
    assert farm.job(job_id).status is JobStatus.FAILED


def test_a_stopped_attempt_counts_for_nothing(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order), failed(order, code="stopped"))
    task = farm.task(order)
    assert (task.status, task.failures, task.failed_on) == (TaskStatus.READY, 0, [])


def test_a_worker_that_fails_three_tasks_of_a_job_is_avoided_for_a_while(farm: Farm) -> None:
    farm.workers = [presence("bad", 4), presence("good", 4)]
    farm.planned(**MANY)
    orders = farm.dispatch()
    for order in orders[:3]:
        farm.say(failed(order, "bad"))
    for order in orders[3:]:
        farm.say(done(order, "good"))
    fresh = [order for order in farm.dispatch() if order.attempt_number == 1]
    assert fresh
    assert {order.avoid for order in fresh} == {("bad",)}
    farm.now_s += farm.settings.avoid_s + 1
    for order in fresh:
        farm.say(done(order, "good"))
    assert {order.avoid for order in farm.dispatch() if order.attempt_number == 1} == {()}


def test_losses_and_failures_are_counted_apart_and_a_retry_forgets_both(farm: Farm) -> None:
    farm.settings = farm.settings.model_copy(update={"losses_allowed": 5, "failures_allowed": 3})
    farm.planned(**MANY)
    order, *_ = farm.dispatch()
    for code in ("lost", "render-failed", "lost", "render-failed", "lost", "lost"):
        farm.say(claimed(order), failed(order, code=code))
        assert farm.task(order).status is TaskStatus.READY
        order = _again(farm, order.task_id)
    assert (farm.task(order).losses, farm.task(order).failures) == (4, 2)
    farm.say(claimed(order), failed(order, code="lost"))
    assert (farm.task(order).status, farm.task(order).permanent) == (TaskStatus.FAILED, False)
    for other in farm.queue.orders:
        farm.say(done(other))
    farm.work()
    with farm.writing() as session:
        retry_job(session, order.job_id, now_s=farm.now_s, limit=farm.settings.failure_limit)
    assert (farm.task(order).losses, farm.task(order).failures) == (0, 0)


def test_the_task_of_a_lost_attempt_is_sent_again_without_a_pause(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order), failed(order, code="lost"))
    assert order.task_id in [other.task_id for other in farm.dispatch()]


def test_lost_attempts_do_not_count_against_their_worker(farm: Farm) -> None:
    """Workers are also killed by others."""
    farm.workers = [presence("w1", 4), presence("w2", 4)]
    farm.planned(**MANY)
    orders = farm.dispatch()
    for order in orders[:3]:
        farm.say(claimed(order, "w1"), failed(order, "w1", code="lost"))
    for order in orders[3:]:
        farm.say(done(order, "w2"))
    fresh = [order for order in farm.dispatch() if order.attempt_number == 1]
    assert fresh
    assert {order.avoid for order in fresh} == {()}


def test_permanent_failures_do_not_count_against_their_worker(farm: Farm) -> None:
    """An output that cannot be made fails on every worker alike."""
    farm.workers = [presence("w1", 4), presence("w2", 4)]
    farm.planned(frames="1", outputs=[{"kind": "quilt", "name": f"q{number}"} for number in range(30)])
    while (orders := farm.dispatch()) and orders[0].kind is not TaskKind.ENCODE:
        farm.say(*(said for order in orders for said in (claimed(order), done(order))))
    for order in orders[:3]:
        farm.say(claimed(order, "w1"), failed(order, "w1", code="output", permanent=True))
    fresh = farm.dispatch()
    assert fresh
    assert {order.avoid for order in fresh} == {()}


def test_when_every_worker_is_to_be_avoided_none_is(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(failed(order, "w1"))
    assert _again(farm, order.task_id).avoid == ()


@pytest.mark.parametrize("code", sorted(INFRASTRUCTURE))
def test_a_farm_that_is_broken_for_a_while_fails_no_task(farm: Farm, code: str) -> None:
    farm.workers = [presence(slots=50)]
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    for rests in range(1, 60):
        farm.say(claimed(order), failed(order, code=code))
        task = farm.task(order)
        assert (task.status, task.failures, task.failed_on, task.deferrals) == (TaskStatus.READY, 0, [], rests)
        assert (task.error_code, task.error_message) == (code, f"{code} happened")
        pause_s = min(LONGEST_PAUSE_S, farm.settings.deferral_s * 2 ** (rests - 1))
        assert task.not_before_s == farm.now_s + pause_s
        assert order.task_id not in [other.task_id for other in farm.dispatch()]
        farm.now_s += pause_s
        order = _again(farm, order.task_id)
    farm.say(done(order))
    assert (farm.task(order).status, farm.task(order).error_message) == (TaskStatus.DONE, None)
    assert farm.job(job_id).status is JobStatus.RUNNING


@pytest.mark.parametrize("code", sorted(INFRASTRUCTURE))
def test_a_worker_on_which_something_prevents_the_work_is_avoided_at_once_until_the_next_attempt(
    farm: Farm, code: str
) -> None:
    farm.workers = [presence("w1"), presence("w2")]
    farm.planned(**MANY)
    order, *others = farm.dispatch()
    farm.say(claimed(order, "w1"), failed(order, "w1", code=code), *(done(other, "w2") for other in others))
    assert {other.avoid for other in farm.dispatch()} == {("w1",)}
    farm.now_s += farm.settings.deferral_s + 1
    for other in farm.queue.orders:
        farm.say(done(other, "w2"))
    assert {other.avoid for other in farm.dispatch()} == {()}
