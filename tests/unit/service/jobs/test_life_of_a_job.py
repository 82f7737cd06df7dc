"""A job's life, from submit to its end, with a worker played by the test."""

from __future__ import annotations

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from tests.builders_service import Farm, claimed, done


def test_a_job_goes_from_queued_over_probing_and_running_to_done(farm: Farm) -> None:
    job_id = farm.submit()
    assert farm.job(job_id).status is JobStatus.QUEUED

    (order,) = farm.dispatch()
    assert order.kind is TaskKind.PROBE
    assert farm.job(job_id).status is JobStatus.PROBING

    farm.say(claimed(order), done(order))
    farm.plan()
    assert farm.job(job_id).status is JobStatus.RUNNING

    assert farm.work() == 3 * (2 + 1) + 1
    job = farm.job(job_id)
    assert (job.status, job.frames_done, job.done_px, job.ended_s) == (JobStatus.DONE, 3, job.total_px, farm.now_s)


def test_every_task_of_a_done_job_was_ordered_once(farm: Farm) -> None:
    job_id = farm.planned()
    farm.work()
    assert [task.attempt_number for task in farm.tasks(job_id)] == [1] * 11
    assert {task.status for task in farm.tasks(job_id)} == {TaskStatus.DONE}
