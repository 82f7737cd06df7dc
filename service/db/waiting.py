"""Queries that tell why jobs and tasks wait: a constant number of them for a page of jobs or tasks."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from lippmann.job.states import TaskStatus
from service.db.jobs import CLAIM, IS_BUSY, IS_DISPATCHABLE, OPEN
from service.db.tables import Job, Task
from service.db.task_sets import is_due
from service.db.tasks import UNSATISFIED

LINE = 100
"""The largest number of jobs that are looked at to tell which ones come first."""

ClaimRow = tuple[str, int, int, int]
"""A job that wants slots: id, priority, outstanding orders, ready tasks."""


def line(session: Session, *, now_s: float) -> Sequence[ClaimRow]:
    """Return the first jobs with tasks that may be dispatched now, in the order in which they get slots."""
    query = select(*CLAIM).where(*IS_DISPATCHABLE)
    query = query.order_by(Job.priority.desc(), Job.dispatched + Job.running, Job.id).limit(LINE)
    return session.execute(query, {"now_s": now_s}).all()


def holders(session: Session) -> Sequence[tuple[str, int, int, int, int]]:
    """Return the jobs with outstanding orders, the most first, and the number of their running tasks."""
    query = select(*CLAIM, Job.running).where(IS_BUSY, Job.status.in_(OPEN))
    return session.execute(query.order_by((Job.dispatched + Job.running).desc(), Job.id)).all()


def delayed(session: Session, job_ids: Collection[str], *, now_s: float) -> dict[str, Task]:
    """Return the ready task that is due soonest of each job that has no task which may be dispatched now."""
    ready = select(Task.sequence).where(Task.job_id == Job.id, Task.status == TaskStatus.READY, is_due(now_s))
    has_none = ready.correlate(Job).limit(1).scalar_subquery().is_(None)  # as in `service.db.tasks.is_blocked`
    stuck = select(Job.id).where(Job.id.in_([*job_ids]), has_none)
    query = select(Task).where(Task.job_id.in_(stuck), Task.status == TaskStatus.READY)
    found: dict[str, Task] = {}
    for task in session.scalars(query.order_by(Task.not_before_s, Task.sequence)):
        found.setdefault(task.job_id, task)
    return found


def first_ready(session: Session, job_id: str, *, now_s: float) -> int | None:
    """Return the sequence number of the first task of a job that may be dispatched now."""
    query = select(Task.sequence).where(Task.job_id == job_id, Task.status == TaskStatus.READY, is_due(now_s))
    return session.scalar(query.order_by(Task.sequence).limit(1))


def unfinished(session: Session, job_id: str, stages: Iterable[str]) -> Sequence[tuple[str, TaskStatus, int]]:
    """Count the tasks of some stages that are not done: (stage, status, number of tasks)."""
    query = select(Task.stage, Task.status, func.count()).where(Task.job_id == job_id, Task.stage.in_([*stages]))
    return session.execute(query.where(Task.status.in_(UNSATISFIED)).group_by(Task.stage, Task.status)).all()


def members(
    session: Session, job_id: str, stages: Iterable[str], *, limit: int | None = None
) -> Sequence[tuple[str, int]]:
    """Return tasks of some stages that are not done: (stage, sequence number); at most `limit` of them."""
    query = select(Task.stage, Task.sequence).where(Task.job_id == job_id, Task.stage.in_([*stages]))
    query = query.where(Task.status.in_(UNSATISFIED))
    if limit is None:
        return session.execute(query.order_by(Task.sequence)).all()
    # Without an order, an index gives the first rows at once, however many there are.
    return session.execute(query.limit(limit)).all()
