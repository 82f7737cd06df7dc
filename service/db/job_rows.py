"""Named queries about jobs."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.db.tables import Chore, Job
from worker.job.statuses import ENDED_JOBS, JobStatus

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


def dispatchable(session: Session) -> Sequence[Job]:
    """Return the jobs that have something to send out."""
    query = select(Job).where(Job.status.in_(DISPATCHING), Job.ready > 0, Job.chore.is_(None))
    return session.scalars(query.order_by(Job.id), execution_options={"populate_existing": True}).all()


def outstanding(session: Session) -> int:
    """Return how many orders are out, over all jobs."""
    query = select(func.coalesce(func.sum(Job.dispatched + Job.running), 0)).where(Job.status.not_in(ENDED_JOBS))
    return int(session.scalar(query) or 0)


def open_ids(session: Session) -> Sequence[str]:
    """Return the jobs that have not ended."""
    return session.scalars(select(Job.id).where(Job.status.in_(OPEN)).order_by(Job.id)).all()


def chores(session: Session) -> Sequence[tuple[str, Chore]]:
    """Return the jobs whose rows are being worked on, and how."""
    rows = session.execute(select(Job.id, Job.chore).where(Job.chore.is_not(None)).order_by(Job.id))
    return [(job_id, chore) for job_id, chore in rows if chore is not None]
