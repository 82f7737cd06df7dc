"""Completion: a job ends when no task can go on.

An output that fails prevents no other output: the job fails only after the others have ended.
"""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, TaskStatus
from service.db import tasks as task_rows
from service.db.tables import Job, Task
from service.jobs.state_machine import release_tasks, transition_job
from service.settings import FailureLimit


def settle(session: Session, row: Job, *, now_s: float, limit: FailureLimit) -> bool:
    """End a job if its tasks have ended; return whether it ended."""
    if not has_ended(session, row, limit=limit):
        return False
    cause = _cause(session, row, limit) if row.failed else None
    if cause is not None:
        fail_job(session, row, *cause, now_s=now_s)
    else:
        transition_job(session, row, JobStatus.DONE, ended_s=now_s)
    return True


def has_ended(session: Session, row: Job, *, limit: FailureLimit) -> bool:
    """Return whether the tasks of a job have ended while its status is still probing or running."""
    if row.status not in (JobStatus.PROBING, JobStatus.RUNNING) or row.background_job is not None:
        return False
    if row.failed:
        return _cause(session, row, limit) is not None
    return row.planned_s is not None and not _unfinished(row)


def fail_job(session: Session, row: Job, code: str, message: str, *, now_s: float) -> None:
    """Fail a job: running attempts are stopped, and their tasks become ready so that a retry can continue them."""
    release_tasks(session, row, to=TaskStatus.READY, now_s=now_s)
    transition_job(session, row, JobStatus.FAILED, ended_s=now_s, error_code=code, error_message=message)


def _cause(session: Session, row: Job, limit: FailureLimit) -> tuple[str, str] | None:
    """Return code and message of the failure that ends a job; None while it can go on."""
    permanent = task_rows.permanent_failure(session, row.id)
    if permanent is not None:
        return permanent.error_code or "permanent", permanent.error_message or "a task cannot be done"
    if row.planned_s is None:
        return _with_first(task_rows.first_failure(session, row.id), "the probe failed")
    total = sum(getattr(row, status.value) for status in TaskStatus)
    # An output that fails prevents no other output, so it does not count here.
    needed = row.failed - task_rows.failed_outputs(session, row.id)
    if limit.is_exceeded(needed, total):
        what = f"{needed} of {total} tasks failed, more than {limit.share:.0%}"
        return _with_first(task_rows.first_failure(session, row.id), what)
    if not (row.ready or row.dispatched or row.running):
        return _with_first(task_rows.first_failure(session, row.id), f"{row.failed} of {total} tasks failed")
    return None


def _with_first(task: Task | None, what: str) -> tuple[str, str]:
    if task is None:
        return "tasks-failed", what
    which = f"{task.output}: " if task.output else ""
    return "tasks-failed", f"{what}; the first: {which}{task.error_message or task.error_code}"


def _unfinished(row: Job) -> int:
    return row.waiting + row.ready + row.dispatched + row.running + row.failed + row.cancelled
