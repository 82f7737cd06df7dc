"""Named queries about what artifacts belong to."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.db.tables import Job


def is_job(session: Session, job_id: str) -> bool:
    """Return whether a job has a row, also while it is being removed."""
    return session.execute(select(Job.id).where(Job.id == job_id)).first() is not None
