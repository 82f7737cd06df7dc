"""Queries that tell why jobs and tasks wait: a constant number of them for a page of jobs or tasks."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from types import MappingProxyType

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from lippmann.job.states import TaskStatus
from service.db.jobs import CLAIM, IS_BUSY, IS_DISPATCHABLE, OPEN, ClaimRow
from service.db.tables import Job, Task
from service.db.task_sets import is_due
from service.db.tasks import UNSATISFIED

LINE = 100
"""The largest number of jobs that are looked at to tell which ones come first."""

HolderRow = tuple[str, int, int, int, str, int | None, str, int | None, int]
"""The columns of `CLAIM`, and the number of running tasks."""


def line(
    session: Session, *, now_s: float, max_slots: int, held: Mapping[str, int] = MappingProxyType({})
) -> Sequence[ClaimRow]:
    """Return the first jobs with tasks that may be dispatched now, in the order in which they get slots.

    Parameters
    ----------
    max_slots
        The limit of slots of the farm.
    held
        The slots of owners whose jobs are left out where this is as many as their limits allow.
    """
    query = select(*CLAIM).where(*IS_DISPATCHABLE)
    for owner_id, slots in held.items():
        query = query.where(or_(Job.owner_id != owner_id, func.coalesce(Job.max_slots, max_slots) > slots))
    query = query.order_by(Job.priority.desc(), Job.dispatched + Job.running, Job.id).limit(LINE)
    return session.execute(query, {"now_s": now_s}).all()


def holders(session: Session) -> Sequence[HolderRow]:
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
