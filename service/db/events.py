"""Queries on the events of the stream."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from sqlalchemy import Text, cast, delete, func, insert, select
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.jobs import is_seen_by
from service.db.tables import Job, JobEvent
from service.schemas.events import EventTopic

NewEvent = tuple[str, EventTopic, dict[str, Any]]
"""The job, the topic and the data of an event."""


class StoredEvent(NamedTuple):
    """An event; its data is the text of its JSON, which clients receive as it is."""

    id: int
    job_id: str
    topic: EventTopic
    data: str
    owner_id: str | None = None
    """The owner of the job; None if it was not asked for, or the job is gone."""
    shared: bool | None = None
    """True if all owners see the job; None as above."""


def append(session: Session, events: Iterable[NewEvent]) -> None:
    """Append events, by one statement; subscribers receive them after the transaction commits."""
    rows = [{"job_id": job_id, "topic": topic, "data": data} for job_id, topic, data in events]
    if rows:
        session.connection().execute(insert(JobEvent), rows)


def after(
    session: Session,
    position: int,
    *,
    job_id: str | None,
    limit: int,
    until: int | None = None,
    owner_id: str | None = None,
    has_owners: bool = False,
) -> Sequence[StoredEvent]:
    """Return the events after a position, in order, and none after `until`; with `has_owners`, also whose they are."""
    columns: tuple[Any, ...] = (JobEvent.id, JobEvent.job_id, JobEvent.topic, cast(JobEvent.data, Text))
    query = select(*columns, *((Job.owner_id, Job.shared) if has_owners else ())).where(JobEvent.id > position)
    if has_owners:
        query = query.outerjoin(Job, Job.id == JobEvent.job_id)
    if owner_id is not None:
        query = query.where(is_seen_by(owner_id))
    if until is not None:
        query = query.where(JobEvent.id <= until)
    if job_id is not None:
        query = query.where(JobEvent.job_id == job_id)
    return [StoredEvent(*row) for row in session.execute(query.order_by(JobEvent.id).limit(limit))]


def newest(session: Session) -> int:
    """Return the position of the newest event."""
    return int(session.scalar(select(func.max(JobEvent.id))) or 0)


def are_kept(session: Session, position: int) -> bool:
    """Return whether all events after a position are still stored; a position beyond the newest one has no events."""
    first = session.scalar(select(func.min(JobEvent.id)))
    return (0 if first is None else first - 1) <= position <= newest(session)


def prune(session: Session, *, kept: int, limit: int) -> int:
    """Delete at most `limit` of the oldest events beyond the newest `kept`, and return how many were deleted."""
    first = session.scalar(select(func.min(JobEvent.id)))
    stop = newest(session) - kept
    if first is None or first > stop:
        return 0
    return changed(session, delete(JobEvent).where(JobEvent.id <= min(stop, first + limit - 1)))
