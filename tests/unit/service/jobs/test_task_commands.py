"""A single task is given to another slot, or ended for good."""

from __future__ import annotations

import pytest

from lippmann.job.states import JobStatus, TaskStatus
from service.db.coordinator import pending_stops
from service.errors import TransitionNotAllowed
from service.jobs.task_commands import ENDED_BY_USER, end_task, restart_task
from tests.builders_service import Farm, claimed, done


def _end(farm: Farm, task_id: str) -> None:
    with farm.writing() as session:
        end_task(session, farm.task(task_id), by="ann", now_s=farm.now_s, limit=farm.settings.failure_limit)


def test_a_restarted_task_is_ready_again_and_its_attempt_is_told_to_stop_and_counts_no_more(farm: Farm) -> None:
    farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    with farm.writing() as session:
        restart_task(session, farm.task(order), now_s=farm.now_s)
        assert pending_stops(session) == [order.attempt]
    task = farm.task(order)
    assert (task.status, task.failed_on, task.failures) == (TaskStatus.READY, ["w1"], 0)
    farm.say(done(order))
    assert farm.task(order).status is TaskStatus.READY


def test_an_ended_task_fails_for_good_and_its_job_with_it(farm: Farm) -> None:
    job_id = farm.planned()
    order, *_ = farm.dispatch()
    farm.say(claimed(order))
    _end(farm, order.task_id)
    task, job = farm.task(order), farm.job(job_id)
    assert (task.status, task.permanent, task.error_code) == (TaskStatus.FAILED, True, ENDED_BY_USER)
    assert (job.status, job.error_message) == (
        JobStatus.FAILED,
        "ann has ended the task; skip its frame or retry the job",
    )


def test_a_task_that_no_attempt_owns_is_neither_restarted_nor_ended(farm: Farm) -> None:
    job_id = farm.planned()
    waiting = farm.tasks(job_id)[-1]
    expected = "that is waiting; expected one that is dispatched or running"
    with farm.writing() as session, pytest.raises(TransitionNotAllowed, match=expected):
        restart_task(session, waiting, now_s=farm.now_s)
    order, *_ = farm.dispatch()
    with pytest.raises(TransitionNotAllowed, match="that is dispatched; expected one that is running"):
        _end(farm, order.task_id)
