"""The table of moves."""

from __future__ import annotations

import pytest

from lippmann.job.states import ENDED_JOBS, ENDED_TASKS, JOB_MOVES, TASK_MOVES, JobStatus, TaskStatus


def test_every_status_has_its_moves() -> None:
    assert set(JOB_MOVES) == set(JobStatus)
    assert set(TASK_MOVES) == set(TaskStatus)


@pytest.mark.parametrize("job", sorted(ENDED_JOBS))
def test_ended_jobs_move_only_by_retry(job: JobStatus) -> None:
    assert JOB_MOVES[job] == {JobStatus.RUNNING}


@pytest.mark.parametrize("task", sorted(ENDED_TASKS))
def test_ended_tasks_move_only_by_retry(task: TaskStatus) -> None:
    assert TASK_MOVES[task] <= {TaskStatus.READY, TaskStatus.WAITING}


def test_every_job_that_has_not_ended_can_be_cancelled() -> None:
    assert all(JobStatus.CANCELLED in JOB_MOVES[job] for job in set(JobStatus) - ENDED_JOBS)


def test_every_task_that_has_not_ended_can_be_cancelled() -> None:
    assert all(TaskStatus.CANCELLED in TASK_MOVES[task] for task in set(TaskStatus) - ENDED_TASKS)
