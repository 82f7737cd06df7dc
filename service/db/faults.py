"""Queries on the failures of workers, by job."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from service.db.engine import changed
from service.db.jobs import OPEN
from service.db.tables import Job, WorkerFault


def faults(session: Session, pairs: Collection[tuple[str, str]]) -> dict[tuple[str, str], WorkerFault]:
    """Return the row of each pair (job, worker); a row that does not exist yet is added to the session."""
    if not pairs:
        return {}
    job_ids, workers = {job_id for job_id, _ in pairs}, {worker for _, worker in pairs}
    query = select(WorkerFault).where(WorkerFault.job_id.in_(job_ids), WorkerFault.worker.in_(workers))
    query = query.execution_options(populate_existing=True)
    found = {(row.job_id, row.worker): row for row in session.scalars(query)}
    for job_id, worker in pairs:
        if (job_id, worker) not in found:
            found[job_id, worker] = WorkerFault(job_id=job_id, worker=worker, failures=0)
            session.add(found[job_id, worker])
    return found


def avoided_workers(session: Session, job_ids: Collection[str], *, now_s: float) -> dict[str, set[str]]:
    """Return the workers that jobs avoid now, by job."""
    query = select(WorkerFault.job_id, WorkerFault.worker)
    query = query.where(WorkerFault.job_id.in_(job_ids), WorkerFault.avoided_until_s > now_s)
    avoided: dict[str, set[str]] = defaultdict(set)
    for job_id, worker in session.execute(query):
        avoided[job_id].add(worker)
    return avoided


def avoiding(session: Session, *, now_s: float) -> dict[str, int]:
    """Return the number of open jobs that avoid a worker now, by worker; one that none avoids is left out."""
    query = select(WorkerFault.worker, func.count()).join(Job, Job.id == WorkerFault.job_id)
    query = query.where(Job.status.in_(OPEN), WorkerFault.avoided_until_s > now_s)
    return dict(session.execute(query.group_by(WorkerFault.worker)).all())


def forgive(session: Session, worker: str) -> int:
    """Forget the failures of a worker on the tasks of all jobs, and return the number of these jobs."""
    return changed(session, delete(WorkerFault).where(WorkerFault.worker == worker))


def end_avoidance(session: Session, *, latest_s: float) -> None:
    """Let jobs use the workers again that they would avoid until after a time."""
    changed(session, update(WorkerFault).where(WorkerFault.avoided_until_s > latest_s).values(avoided_until_s=None))


def shorten_avoidance(session: Session, *, by_s: float, now_s: float) -> None:
    """Let jobs use the workers again so much earlier that they avoid now."""
    later = update(WorkerFault).where(WorkerFault.avoided_until_s > now_s)
    changed(session, later.values(avoided_until_s=WorkerFault.avoided_until_s - by_s))
