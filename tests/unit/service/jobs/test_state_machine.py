"""The code follows the tables of moves: what they allow happens, what they do not is a 409 that names both statuses."""

from __future__ import annotations

import pytest
from sqlalchemy import update

from lippmann.job.states import JOB_MOVES, TASK_MOVES, JobStatus, TaskStatus
from service.db.counters import move_task
from service.db.tables import Job, Task
from service.errors import MoveNotAllowed
from service.jobs.state_machine import find_job, move_job
from tests.builders_service import Client, Farm

BY_USERS = {
    "cancel": {JobStatus.QUEUED, JobStatus.PROBING, JobStatus.RUNNING, JobStatus.PAUSED},
    "pause": {JobStatus.PROBING, JobStatus.RUNNING},
    "resume": {JobStatus.PAUSED},
    "retry": {JobStatus.FAILED, JobStatus.CANCELLED},
}
BECOMES = {
    "cancel": JobStatus.CANCELLED, "pause": JobStatus.PAUSED, "resume": JobStatus.RUNNING, "retry": JobStatus.RUNNING,
}  # fmt: skip


def _put(farm: Farm, job_id: str, status: JobStatus) -> None:
    with farm.writing() as session:
        session.execute(update(Job).where(Job.id == job_id).values(status=status))


@pytest.mark.parametrize("was", JobStatus)
@pytest.mark.parametrize("to", JobStatus)
def test_a_job_moves_as_the_table_says_and_no_other_way(farm: Farm, was: JobStatus, to: JobStatus) -> None:
    job_id = farm.submit()
    _put(farm, job_id, was)
    with farm.writing() as session:
        row = find_job(session, job_id)
        if to in JOB_MOVES[was]:
            assert move_job(session, row, to).status is to
        else:
            with pytest.raises(MoveNotAllowed, match=f"{was} cannot become {to}"):
                move_job(session, row, to)


@pytest.mark.parametrize("was", TaskStatus)
@pytest.mark.parametrize("to", TaskStatus)
def test_a_task_moves_as_the_table_says_and_no_other_way(farm: Farm, was: TaskStatus, to: TaskStatus) -> None:
    job_id = farm.submit()
    with farm.writing() as session:
        session.execute(update(Task).where(Task.job_id == job_id).values(status=was))
    with farm.writing() as session:
        task = session.get_one(Task, (job_id, 0))
        if to in TASK_MOVES[was]:
            assert move_task(session, task, to)
            assert task.status is to
        else:
            with pytest.raises(ValueError, match=f"{was} -> {to}"):
                move_task(session, task, to)


def test_a_move_of_what_has_moved_meanwhile_does_nothing(farm: Farm) -> None:
    job_id = farm.submit()
    with farm.database.reading() as session:
        seen = session.get_one(Task, (job_id, 0))
    farm.dispatch()
    with farm.writing() as session:
        assert move_task(session, seen, TaskStatus.CANCELLED) is False
    assert farm.task(f"{job_id}-0").status is TaskStatus.DISPATCHED


@pytest.mark.parametrize("was", JobStatus)
@pytest.mark.parametrize("action", BY_USERS)
def test_users_move_jobs_only_as_allowed_and_are_told_both_statuses(
    api: Client, api_farm: Farm, was: JobStatus, action: str
) -> None:
    job_id = api_farm.submit()
    _put(api_farm, job_id, was)
    answer = api.post(f"/api/v1/jobs/{job_id}/{action}")
    if was in BY_USERS[action]:
        assert answer.status_code == 200
        assert answer.json()["status"] == BECOMES[action]
    else:
        assert answer.status_code == 409
        problem = answer.json()
        assert problem["code"] == "move-not-allowed"
        assert was in problem["detail"]
        assert BECOMES[action] in problem["detail"]
        assert api_farm.job(job_id).status is was


@pytest.mark.parametrize("was", JobStatus)
def test_only_ended_jobs_are_removed(api: Client, api_farm: Farm, was: JobStatus) -> None:
    job_id = api_farm.submit()
    _put(api_farm, job_id, was)
    ended = was in {JobStatus.DONE, JobStatus.FAILED, JobStatus.CANCELLED}
    assert api.delete(f"/api/v1/jobs/{job_id}").status_code == (204 if ended else 409)
    assert api.get(f"/api/v1/jobs/{job_id}").status_code == (404 if ended else 200)
