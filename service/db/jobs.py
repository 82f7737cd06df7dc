"""Named queries about jobs."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import ColumnElement, func, or_, select
from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, TaskStatus
from service.db.tables import Chore, Job, Task

DISPATCHING = (JobStatus.QUEUED, JobStatus.PROBING, JobStatus.RUNNING)
"""Jobs whose tasks may go out."""
OPEN = (*DISPATCHING, JobStatus.PAUSED)


def job(session: Session, job_id: str) -> Job | None:
    """Return a job as the database has it now, unless it is being removed."""
    found = session.get(Job, job_id, populate_existing=True)
    return None if found is None or found.chore is Chore.REMOVE else found


def page(session: Session, *, status: JobStatus | None, before: str | None, limit: int) -> Sequence[Job]:
    """Return jobs, newest first, from below an id."""
    query = select(Job).where(Job.chore.is_distinct_from(Chore.REMOVE))
    if status is not None:
        query = query.where(Job.status == status)
    if before is not None:
        query = query.where(Job.id < before)
    return session.scalars(query.order_by(Job.id.desc()).limit(limit)).all()


def can_dispatch(session: Session, *, now_s: float) -> bool:
    """Return whether some task may go out now."""
    query = select(Job.id).where(*_dispatchable(now_s))
    return session.execute(query.limit(1)).first() is not None


def claims(session: Session, *, now_s: float) -> Sequence[tuple[str, int, int, int]]:
    """Return the jobs whose tasks may go out now: (id, priority, orders out, tasks ready)."""
    query = select(Job.id, Job.priority, (Job.dispatched + Job.running).label("outstanding"), Job.ready)
    return session.execute(query.where(*_dispatchable(now_s)).order_by(Job.id)).all()


def outstanding(session: Session) -> int:
    """Return how many orders are out, over all jobs."""
    query = select(func.coalesce(func.sum(Job.dispatched + Job.running), 0)).where(Job.status.in_(OPEN))
    return int(session.scalar(query) or 0)


def busy_ids(session: Session) -> Sequence[str]:
    """Return the jobs that have orders out; the shallow queue keeps them few."""
    query = select(Job.id).where(Job.status.in_(OPEN), Job.dispatched + Job.running > 0)
    return session.scalars(query.order_by(Job.id)).all()


def restless(session: Session, *, after: str, limit: int) -> Sequence[str]:
    """Return jobs whose rows may have to be made right: something waits or failed, or nothing is left to do."""
    left = Job.waiting + Job.ready + Job.dispatched + Job.running + Job.cancelled
    is_over = Job.planned_s.is_not(None) & (left == 0)
    query = select(Job.id).where(Job.status.in_(OPEN), Job.chore.is_(None), Job.id > after)
    query = query.where(or_(Job.waiting > 0, Job.failed > 0, is_over))
    return session.scalars(query.order_by(Job.id).limit(limit)).all()


def open_ids(session: Session) -> Sequence[str]:
    """Return the jobs that have not ended."""
    return session.scalars(select(Job.id).where(Job.status.in_(OPEN)).order_by(Job.id)).all()


def chores(session: Session) -> Sequence[tuple[str, Chore]]:
    """Return the jobs whose rows are being worked on, and how."""
    rows = session.execute(select(Job.id, Job.chore).where(Job.chore.is_not(None)).order_by(Job.id))
    return [(job_id, chore) for job_id, chore in rows if chore is not None]


def _dispatchable(now_s: float) -> tuple[ColumnElement[bool], ...]:
    task = select(Task.sequence).where(Task.job_id == Job.id, Task.status == TaskStatus.READY)
    may_go = task.where(or_(Task.not_before_s.is_(None), Task.not_before_s <= now_s)).correlate(Job).exists()
    return Job.status.in_(DISPATCHING), Job.ready > 0, Job.chore.is_(None), may_go
