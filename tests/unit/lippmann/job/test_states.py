"""The tables of transitions and actions are complete and agree with each other."""

from __future__ import annotations

import pytest

from lippmann.job.states import (
    ENDED_JOBS,
    ENDED_TASKS,
    HELD_TASKS,
    JOB_ACTIONS,
    JOB_TRANSITIONS,
    SATISFIED_TASKS,
    TASK_TRANSITIONS,
    JobAction,
    JobStatus,
    TaskStatus,
    actions_for,
)


def test_every_status_has_its_transitions_and_every_action_its_rule() -> None:
    assert set(JOB_TRANSITIONS) == set(JobStatus)
    assert set(TASK_TRANSITIONS) == set(TaskStatus)
    assert set(JOB_ACTIONS) == set(JobAction)


@pytest.mark.parametrize("action", [action for action, rule in JOB_ACTIONS.items() if rule.leads_to is not None])
def test_an_action_leads_only_where_the_table_of_transitions_allows(action: JobAction) -> None:
    rule = JOB_ACTIONS[action]
    assert all(rule.leads_to in JOB_TRANSITIONS[status] for status in rule.allowed_in)


@pytest.mark.parametrize("job", sorted(ENDED_JOBS))
def test_a_job_that_ended_changes_only_by_retry_and_repair(job: JobStatus) -> None:
    assert JOB_TRANSITIONS[job] == {JobStatus.RUNNING}
    assert job in JOB_ACTIONS[JobAction.REPAIR].allowed_in


def test_a_done_job_can_only_be_repaired_and_removed() -> None:
    assert actions_for(JobStatus.DONE) == (JobAction.REPAIR, JobAction.REMOVE)


@pytest.mark.parametrize("task", sorted(ENDED_TASKS))
def test_a_task_that_ended_changes_only_by_retry_and_skip(task: TaskStatus) -> None:
    assert TASK_TRANSITIONS[task] - {TaskStatus.SKIPPED} <= {TaskStatus.READY, TaskStatus.WAITING}


def test_every_task_that_is_not_done_and_that_no_attempt_owns_can_be_skipped() -> None:
    can = {task for task in TaskStatus if TaskStatus.SKIPPED in TASK_TRANSITIONS[task]}
    assert can == set(TaskStatus) - HELD_TASKS - SATISFIED_TASKS


def test_a_done_job_can_be_retried_only_to_bring_skipped_frames_back() -> None:
    assert set(actions_for(JobStatus.DONE, skipped=3)) - set(actions_for(JobStatus.DONE)) == {JobAction.RETRY}
    assert all(actions_for(job, skipped=3) == actions_for(job) for job in set(JobStatus) - {JobStatus.DONE})


def test_every_job_that_has_not_ended_can_be_cancelled() -> None:
    assert JOB_ACTIONS[JobAction.CANCEL].allowed_in == set(JobStatus) - ENDED_JOBS


def test_every_task_that_has_not_ended_can_be_cancelled() -> None:
    assert all(TaskStatus.CANCELLED in TASK_TRANSITIONS[task] for task in set(TaskStatus) - ENDED_TASKS)
