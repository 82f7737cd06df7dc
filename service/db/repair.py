"""Named queries about what cannot be read any more, and about rows that still call it done."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from lippmann.job.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.db.tables import Task

PAGE = 100
"""Frames that are looked at together."""


def unreadable(session: Session, job_id: str, kind: TaskKind, codes: Collection[str], *, after: int) -> Sequence[Task]:
    """Return one page of the ended tasks of a kind whose last error is one of `codes`."""
    query = (
        select(Task)
        .where(Task.job_id == job_id, Task.status.in_([TaskStatus.FAILED, TaskStatus.CANCELLED]))
        .where(Task.kind == kind, Task.error_code.in_(codes), Task.sequence > after)
    )
    return session.scalars(query.order_by(Task.sequence).limit(PAGE)).all()


def done_assemblies(session: Session, job_id: str, *, after: int) -> Sequence[Task]:
    """Return one page of the assemblies that are done."""
    query = select(Task).where(Task.job_id == job_id, Task.status == TaskStatus.DONE)
    query = query.where(Task.kind == TaskKind.ASSEMBLE, Task.sequence > after)
    return session.scalars(query.order_by(Task.sequence).limit(PAGE)).all()


def done_renders(session: Session, job_id: str, frames: Iterable[int | None]) -> Sequence[Task]:
    """Return the tiles of some frames that are done."""
    query = select(Task).where(Task.job_id == job_id, Task.frame.in_([*frames]), Task.status == TaskStatus.DONE)
    return session.scalars(query.where(Task.kind == TaskKind.RENDER).order_by(Task.sequence)).all()


def standing_of(
    session: Session, job_id: str, status: TaskStatus, *, sequences: Iterable[int] = (), needs: Iterable[str] = ()
) -> Sequence[Task]:
    """Return which tasks stand at a status: some by number, or those that need one of some stages."""
    stages = [*needs]
    which = Task.needs.in_(stages) if stages else Task.sequence.in_([*sequences])
    query = select(Task).where(Task.job_id == job_id, Task.status == status, which)
    return session.scalars(query.order_by(Task.sequence), execution_options={"populate_existing": True}).all()
