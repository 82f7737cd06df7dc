"""A job ends when nothing is left to do, or nothing can go on: outputs that fail end it only after all others."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, TaskStatus
from service.db import tasks as task_rows
from service.db.tables import Job, Task
from service.jobs.release import release
from service.jobs.state_machine import move_job


def settle(session: Session, row: Job, *, now_s: float, failed_share: float) -> bool:
    """End a job if its rows say that it has ended; True if so."""
    if not has_ended(session, row, failed_share=failed_share):
        return False
    cause = _cause(session, row, failed_share) if row.failed else None
    if cause is not None:
        fail_job(session, row, *cause, now_s=now_s)
    else:
        move_job(session, row, JobStatus.DONE, ended_s=now_s)
    return True


def has_ended(session: Session, row: Job, *, failed_share: float) -> bool:
    """Return whether a job's rows say that it has ended, though it does not say so itself."""
    if row.status not in (JobStatus.PROBING, JobStatus.RUNNING) or row.chore is not None:
        return False
    if row.failed:
        return _cause(session, row, failed_share) is not None
    return row.planned_s is not None and not _left(row)


def fail_job(session: Session, row: Job, code: str, message: str, *, now_s: float) -> None:
    """End a job; what runs is stopped and its tasks stay, so that retry can go on from there."""
    release(session, row, to=TaskStatus.READY, now_s=now_s)
    move_job(session, row, JobStatus.FAILED, ended_s=now_s, error_code=code, error_message=message)


def _cause(session: Session, row: Job, failed_share: float) -> tuple[str, str] | None:
    permanent = task_rows.permanent_failure(session, row.id)
    if permanent is not None:
        return permanent.error_code or "permanent", permanent.error_message or "a task cannot be done"
    if row.planned_s is None:
        return _of(task_rows.first_failure(session, row.id), "the probe failed")
    total = sum(getattr(row, status.value) for status in TaskStatus)
    # One output that cannot be made keeps no other from being made.
    needed = row.failed - task_rows.failed_outputs(session, row.id)
    if needed > failed_share * total:
        what = f"{needed} of {total} tasks failed, more than {failed_share:.0%}"
        return _of(task_rows.first_failure(session, row.id), what)
    if not (row.ready or row.dispatched or row.running):
        return _of(task_rows.first_failure(session, row.id), f"{row.failed} of {total} tasks failed")
    return None


def _of(task: Task | None, what: str) -> tuple[str, str]:
    if task is None:
        return "tasks-failed", what
    which = f"{task.output}: " if task.output else ""
    return "tasks-failed", f"{what}; the first: {which}{task.error_message or task.error_code}"


def _left(row: Job) -> int:
    return row.waiting + row.ready + row.dispatched + row.running + row.failed + row.cancelled
