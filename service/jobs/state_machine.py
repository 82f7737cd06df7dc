"""The moves of a job: one door, guarded, and listeners are told."""

from __future__ import annotations

from typing import Any

from sqlalchemy import update
from sqlalchemy.orm import Session

from lippmann.job.states import JOB_MOVES, JobStatus
from service.db import jobs as job_rows
from service.db.engine import changed
from service.db.tables import Job
from service.errors import MoveNotAllowed, NotFound
from service.events.publish import tell_job


def find_job(session: Session, job_id: str) -> Job:
    """Return a job.

    Raises
    ------
    NotFound
        If there is none.
    """
    row = job_rows.job(session, job_id)
    if row is None:
        raise NotFound(f"there is no job {job_id!r}")
    return row


def move_job(session: Session, row: Job, to: JobStatus, **values: Any) -> Job:
    """Move a job as it was read, and tell listeners.

    Raises
    ------
    MoveNotAllowed
        If the table has no such move, or the job moved meanwhile.
    """
    if to not in JOB_MOVES[row.status]:
        raise MoveNotAllowed(f"a job that is {row.status} cannot become {to}")
    statement = update(Job).where(Job.id == row.id, Job.status == row.status).values(status=to, **values)
    if changed(session, statement) == 0:
        raise MoveNotAllowed(f"the job is no longer {row.status}, so it cannot become {to}")
    session.refresh(row)
    tell_job(session, row)
    return row


def set_job(session: Session, row: Job, **values: Any) -> Job:
    """Change what is remembered of a job besides its status."""
    changed(session, update(Job).where(Job.id == row.id).values(**values))
    session.refresh(row)
    return row
