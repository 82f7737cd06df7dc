"""A job ends because someone wants it to. What attempts hold is taken from them at once, the rest in pieces."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, TaskStatus
from service.db import tasks as task_rows
from service.db.counters import move_tasks
from service.db.tables import Chore, Job
from service.jobs.release import release
from service.jobs.state_machine import find_job, move_job, set_job


def cancel_job(session: Session, job_id: str, *, now_s: float) -> Job:
    """End a job."""
    row = move_job(session, find_job(session, job_id), JobStatus.CANCELLED, ended_s=now_s, chore=Chore.CANCEL)
    release(session, row, to=TaskStatus.CANCELLED, now_s=now_s)
    cancel_some(session, row, now_s=now_s)
    return row


def cancel_some(session: Session, row: Job, *, now_s: float) -> bool:
    """Cancel one chunk of what has not ended; True while there is more."""
    standing = task_rows.standing(session, row.id, [TaskStatus.WAITING, TaskStatus.READY])
    for status in (TaskStatus.WAITING, TaskStatus.READY):
        sequences = [sequence for sequence, was in standing if was is status]
        move_tasks(session, row.id, sequences, status, TaskStatus.CANCELLED, ended_s=now_s)
    more = len(standing) == task_rows.CHUNK
    set_job(session, row, chore=Chore.CANCEL if more else None)
    return more
