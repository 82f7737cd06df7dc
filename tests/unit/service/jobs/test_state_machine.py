"""The code follows the tables of states and actions: what they allow happens, and anything else is refused."""

from __future__ import annotations

from typing import Any

import pytest
from sqlalchemy import update

from lippmann.job.states import JOB_ACTIONS, JOB_TRANSITIONS, TASK_TRANSITIONS, JobAction, JobStatus, TaskStatus
from service.db import task_sets
from service.db import tasks as task_rows
from service.db.tables import Job, Task
from service.db.task_sets import StaleRead
from service.errors import TransitionNotAllowed
from service.jobs.state_machine import find_job, transition_job, transition_tasks, write_drafts
from service.jobs.task_draft import TaskDraft
from tests.builders_service import T0, Client, Farm


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
        if to in JOB_TRANSITIONS[was]:
            assert transition_job(session, row, to).status is to
        else:
            with pytest.raises(TransitionNotAllowed, match=f"{was} cannot become {to}"):
                transition_job(session, row, to)


@pytest.mark.parametrize("was", TaskStatus)
@pytest.mark.parametrize("to", TaskStatus)
def test_a_task_moves_as_the_table_says_and_no_other_way(farm: Farm, was: TaskStatus, to: TaskStatus) -> None:
    job_id = farm.submit()
    with farm.writing() as session:
        session.execute(update(Task).where(Task.job_id == job_id).values(status=was))
    with farm.writing() as session:
        (draft,) = map(TaskDraft, task_sets.states(session, [(job_id, 0)]).values())
        if to in TASK_TRANSITIONS[was]:
            draft.transition(to)
            write_drafts(session, [draft], now_s=T0)
        else:
            with pytest.raises(ValueError, match=f"{was} -> {to}"):
                draft.transition(to)
    assert farm.task(f"{job_id}-0").status is (to if to in TASK_TRANSITIONS[was] else was)


def test_a_move_of_what_has_moved_meanwhile_does_nothing(farm: Farm) -> None:
    job_id = farm.submit()
    with farm.database.reading() as session:
        draft = TaskDraft(task_sets.states(session, [(job_id, 0)])[job_id, 0])
    farm.dispatch()
    draft.transition(TaskStatus.CANCELLED)
    with pytest.raises(StaleRead), farm.writing() as session:
        write_drafts(session, [draft], now_s=T0)
    assert farm.task(f"{job_id}-0").status is TaskStatus.DISPATCHED


@pytest.mark.parametrize("was", JobStatus)
@pytest.mark.parametrize("action", JobAction)
def test_an_action_follows_the_table_and_a_refusal_names_action_and_status(
    api: Client, api_farm: Farm, was: JobStatus, action: JobAction
) -> None:
    job_id = api_farm.planned() if action is JobAction.SKIP else api_farm.submit()
    _put(api_farm, job_id, was)
    assert (action in api.get(f"/api/v1/jobs/{job_id}").json()["actions"]) == (was in JOB_ACTIONS[action].allowed_in)
    answer = _act(api, job_id, action)
    if was not in JOB_ACTIONS[action].allowed_in:
        problem = answer.json()
        code = "job-not-ended" if action is JobAction.REMOVE else "move-not-allowed"
        assert (answer.status_code, problem["code"]) == (409, code)
        assert action in problem["detail"]
        assert was in problem["detail"]
        assert api_farm.job(job_id).status is was
    elif action is JobAction.REMOVE:
        assert answer.status_code == 204
        assert api.get(f"/api/v1/jobs/{job_id}").status_code == 404
    else:
        assert answer.status_code == 200
        assert answer.json()["status"] == (JOB_ACTIONS[action].leads_to or was)


def _act(api: Client, job_id: str, action: JobAction) -> Any:
    url = f"/api/v1/jobs/{job_id}"
    if action is JobAction.REMOVE:
        return api.delete(url)
    if action is JobAction.PRIORITISE:
        return api.patch(url, json={"priority": 7})
    body = {"frames": [2]} if action is JobAction.SKIP else None
    return api.post(f"{url}/{action}", json=body)


def test_more_tasks_are_found_and_changed_at_once_than_a_statement_of_postgresql_takes_parameters(
    api_farm: Farm,
) -> None:
    job_id = api_farm.planned()
    many = range(70_000)
    with api_farm.writing() as session:
        ready = task_rows.numbered(session, job_id, many, status=TaskStatus.READY)
        assert transition_tasks(session, job_id, many, TaskStatus.READY, TaskStatus.CANCELLED) == len(ready) > 0
        assert len(task_rows.of_frames(session, job_id, many)) > len(ready)
    assert api_farm.job(job_id).ready == 0
