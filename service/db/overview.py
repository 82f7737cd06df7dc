"""Queries that show a whole job at once: the statuses of all frames, the newest frame."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from sqlalchemy import select
from sqlalchemy.orm import Session

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.db.tables import Job, Task


def newest_frames(session: Session, job_ids: Iterable[str]) -> dict[str, int]:
    """Return the frame of the last assembly task that is done, by job; a job without one is left out."""
    ids = list(job_ids)
    if not ids:
        return {}
    last = select(Task.frame).where(Task.job_id == Job.id, Task.status == TaskStatus.DONE)
    last = last.where(Task.kind == TaskKind.ASSEMBLE).order_by(Task.sequence.desc()).limit(1)
    query = select(Job.id, last.correlate(Job).scalar_subquery())
    query = query.where(Job.id.in_(ids))
    return {job_id: frame for job_id, frame in session.execute(query) if frame is not None}


def all_frames(session: Session, job_id: str) -> Iterator[tuple[int, TaskKind, TaskStatus]]:
    """Yield the different statuses of the tasks of each kind of every frame: (frame, kind, status)."""
    columns = Task.__table__.c
    query = select(columns.frame, columns.kind, columns.status).where(columns.job_id == job_id)
    # A job has tens of thousands of them, and a session would take several times as long for its rows.
    for row in session.connection().execute(query.where(columns.frame.is_not(None)).distinct()):
        yield row.frame, row.kind, row.status
