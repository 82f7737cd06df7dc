"""Queries on the events of the stream."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from sqlalchemy import delete, func, insert, select
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.tables import JobEvent
from service.schemas.events import EventTopic

NewEvent = tuple[str, EventTopic, dict[str, Any]]
"""The job, the topic and the data of an event."""


def append(session: Session, events: Iterable[NewEvent]) -> None:
    """Append events, by one statement; subscribers receive them after the transaction commits."""
    rows = [{"job_id": job_id, "topic": topic, "data": data} for job_id, topic, data in events]
    if rows:
        session.connection().execute(insert(JobEvent), rows)


def after(session: Session, position: int, *, job_id: str | None, limit: int) -> Sequence[JobEvent]:
    """Return the events after a position, in order."""
    query = select(JobEvent).where(JobEvent.id > position)
    if job_id is not None:
        query = query.where(JobEvent.job_id == job_id)
    return session.scalars(query.order_by(JobEvent.id).limit(limit)).all()


def newest(session: Session) -> int:
    """Return the position of the newest event."""
    return int(session.scalar(select(func.max(JobEvent.id))) or 0)


def prune(session: Session, *, kept: int, limit: int) -> int:
    """Delete at most `limit` of the oldest events beyond the newest `kept`, and return how many were deleted."""
    first = session.scalar(select(func.min(JobEvent.id)))
    stop = newest(session) - kept
    if first is None or first > stop:
        return 0
    return changed(session, delete(JobEvent).where(JobEvent.id <= min(stop, first + limit - 1)))
