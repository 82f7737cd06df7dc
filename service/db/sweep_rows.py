"""Named queries about what artifacts belong to."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.db.tables import Job, Scene

PAGE = 1000


def is_job(session: Session, job_id: str) -> bool:
    """Return whether a job has a row, also while it is being removed."""
    return session.execute(select(Job.id).where(Job.id == job_id)).first() is not None


def job_ids(session: Session, *, after: str) -> Sequence[str]:
    """Return one page of the names of jobs."""
    return session.scalars(select(Job.id).where(Job.id > after).order_by(Job.id).limit(PAGE)).all()


def is_scene(session: Session, digest: str) -> bool:
    """Return whether a scene has this bundle."""
    return session.execute(select(Scene.name).where(Scene.digest == digest)).first() is not None
