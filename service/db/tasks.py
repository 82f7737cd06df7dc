"""Named queries about tasks. Every one of them begins at a job and ends at a limit."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sqlalchemy import ColumnElement, Select, func, or_, select
from sqlalchemy.orm import Session, aliased

from lippmann.job.orders import TaskKind
from lippmann.job.states import HELD_TASKS, TaskStatus
from service.db.tables import Task, WorkerFault

CHUNK = 1000
"""Rows that one transaction touches at most."""
NOT_DONE = tuple(status for status in TaskStatus if status is not TaskStatus.DONE)


def task(session: Session, job_id: str, sequence: int) -> Task | None:
    """Return a task as the database has it now."""
    return session.get(Task, (job_id, sequence), populate_existing=True)


def page(
    session: Session, job_id: str, *, status: TaskStatus | None, kind: TaskKind | None, after: int, limit: int
) -> Sequence[Task]:
    """Return tasks of a job in order, from above a sequence number."""
    query = select(Task).where(Task.job_id == job_id, Task.sequence > after)
    if status is not None:
        query = query.where(Task.status == status)
    if kind is not None:
        query = query.where(Task.kind == kind)
    return session.scalars(query.order_by(Task.sequence).limit(limit)).all()


def ready(session: Session, job_id: str, *, now_s: float, after: int, limit: int) -> Sequence[Task]:
    """Return tasks that may go out, in order."""
    query = (
        select(Task)
        .where(Task.job_id == job_id, Task.status == TaskStatus.READY, Task.sequence > after)
        .where(or_(Task.not_before_s.is_(None), Task.not_before_s <= now_s))
    )
    return session.scalars(_fresh(query.order_by(Task.sequence).limit(limit))).all()


def held(session: Session, job_ids: Iterable[str], *, status: TaskStatus | None = None) -> Sequence[Task]:
    """Return the tasks that an attempt owns; the shallow queue keeps them few."""
    statuses = HELD_TASKS if status is None else (status,)
    query = select(Task).where(Task.job_id.in_(list(job_ids)), Task.status.in_(statuses))
    return session.scalars(_fresh(query.order_by(Task.job_id, Task.sequence))).all()


def standing(session: Session, job_id: str, statuses: Iterable[TaskStatus]) -> Sequence[tuple[int, TaskStatus]]:
    """Return one chunk of the tasks that stand at one of `statuses`."""
    query = select(Task.sequence, Task.status).where(Task.job_id == job_id, Task.status.in_(list(statuses)))
    return session.execute(query.limit(CHUNK)).all()


def stage_is_done(session: Session, job_id: str, stage: str) -> bool:
    """Return whether every task of a stage is done."""
    query = select(Task.sequence).where(Task.job_id == job_id, Task.stage == stage, Task.status.in_(NOT_DONE))
    return session.execute(query.limit(1)).first() is None


def waiting_for(session: Session, job_id: str, stage: str) -> Sequence[int]:
    """Return the tasks that wait for a stage."""
    query = select(Task.sequence).where(Task.job_id == job_id, Task.needs == stage, Task.status == TaskStatus.WAITING)
    return session.scalars(query.order_by(Task.sequence)).all()


def retriable(session: Session, job_id: str) -> Sequence[tuple[int, TaskStatus, bool]]:
    """Return one chunk of failed and cancelled tasks: sequence, status, whether what they need is not done."""
    query = select(Task.sequence, Task.status, _is_blocked().label("blocked")).where(
        Task.job_id == job_id, Task.status.in_([TaskStatus.FAILED, TaskStatus.CANCELLED])
    )
    return session.execute(query.limit(CHUNK)).all()


def overdue(session: Session, job_id: str, *, after: int) -> tuple[list[int], int | None]:
    """Look at one chunk of waiting tasks: which could go, and where the next chunk begins (None at the end)."""
    query = select(Task.sequence, _is_blocked()).where(
        Task.job_id == job_id, Task.status == TaskStatus.WAITING, Task.sequence > after
    )
    rows = session.execute(query.order_by(Task.sequence).limit(CHUNK)).all()
    free = [sequence for sequence, blocked in rows if not blocked]
    return free, rows[-1][0] if len(rows) == CHUNK else None


def last_sequence(session: Session, job_id: str) -> int:
    """Return the highest sequence number that a job's tasks have."""
    return int(session.scalar(select(func.max(Task.sequence)).where(Task.job_id == job_id)) or 0)


def permanent_failure(session: Session, job_id: str) -> Task | None:
    """Return a task that no attempt can do, and others need; an output is needed by none."""
    query = select(Task).where(Task.job_id == job_id, Task.status == TaskStatus.FAILED, Task.permanent.is_(True))
    query = query.where(Task.kind != TaskKind.ENCODE)
    return session.scalars(query.order_by(Task.sequence).limit(1)).first()


def first_failure(session: Session, job_id: str) -> Task | None:
    """Return the first task that failed."""
    query = select(Task).where(Task.job_id == job_id, Task.status == TaskStatus.FAILED)
    return session.scalars(query.order_by(Task.sequence).limit(1)).first()


def failed_outputs(session: Session, job_id: str) -> int:
    """Return how many outputs of a job failed."""
    query = select(func.count()).where(
        Task.job_id == job_id, Task.stage == TaskKind.ENCODE.value, Task.status == TaskStatus.FAILED
    )
    return int(session.scalar(query) or 0)


def done_outputs(session: Session, job_ids: Iterable[str]) -> set[tuple[str, str]]:
    """Return which jobs have which outputs: (job, output)."""
    query = select(Task.job_id, Task.output).where(
        Task.job_id.in_(list(job_ids)), Task.stage == TaskKind.ENCODE.value, Task.status == TaskStatus.DONE
    )
    return {(job_id, output or "") for job_id, output in session.execute(query)}


def running_px(session: Session, job_ids: Iterable[str]) -> dict[str, float]:
    """Return the pixels that running attempts say they have done, by job."""
    query = (
        select(Task.job_id, func.sum(Task.weight_px * func.coalesce(Task.progress, 0.0)))
        .where(Task.job_id.in_(list(job_ids)), Task.status == TaskStatus.RUNNING)
        .group_by(Task.job_id)
    )
    return {job_id: float(px or 0.0) for job_id, px in session.execute(query)}


def running_on(session: Session, job_ids: Iterable[str]) -> dict[str, int]:
    """Return how many tasks every worker runs."""
    query = (
        select(Task.worker, func.count())
        .where(Task.job_id.in_(list(job_ids)), Task.status == TaskStatus.RUNNING)
        .group_by(Task.worker)
    )
    return {worker or "": n for worker, n in session.execute(query)}


def frames(
    session: Session, job_id: str, numbers: Sequence[int]
) -> Sequence[tuple[int | None, TaskKind, TaskStatus, int]]:
    """Return how the tasks of some frames stand: (frame, kind, status, tasks)."""
    query = (
        select(Task.frame, Task.kind, Task.status, func.count())
        .where(Task.job_id == job_id, Task.frame.in_(numbers))
        .group_by(Task.frame, Task.kind, Task.status)
    )
    return session.execute(query).all()


def avoided(session: Session, job_id: str, *, now_s: float) -> set[str]:
    """Return the workers that get nothing of a job for now."""
    query = select(WorkerFault.worker).where(WorkerFault.job_id == job_id, WorkerFault.until_s > now_s)
    return set(session.scalars(query))


def _is_blocked() -> ColumnElement[bool]:
    other = aliased(Task)
    needed = select(other.sequence).where(
        other.job_id == Task.job_id, other.stage == Task.needs, other.status.in_(NOT_DONE)
    )
    return needed.correlate(Task).exists()


def _fresh(query: Select[Task]) -> Select[Task]:
    return query.execution_options(populate_existing=True)
