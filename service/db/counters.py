"""The counters in the row of a job: tasks by status, frames, pixels and seconds.

The transaction that changes tasks also changes the counters, by one statement for all jobs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from sqlalchemy import ColumnElement, ScalarSelect, bindparam, func, or_, select, update
from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, TaskStatus
from service.db.engine import changed
from service.db.tables import Job, Task
from service.db.usage import add_artifact_bytes

GAINS = (
    "frames_done", "total_px", "done_px", "cpu_s", "wall_s", "late_events", "cache_hits", "cached_px", "artifact_bytes",
)  # fmt: skip
"""The counters of a job that count no tasks."""
_COLUMNS = (*(status.value for status in TaskStatus), *GAINS)
_ADD = (
    update(Job)
    .where(Job.id == bindparam("of_job"))
    .values({name: getattr(Job, name) + bindparam(f"add_{name}") for name in _COLUMNS})
)

Gains = Mapping[str, float]
"""The amounts to add to the counters of a job, by the name of the column."""


def add_to_counters(session: Session, gains: Mapping[str, Gains]) -> None:
    """Add to the counters of jobs, by one statement; a job that does not exist is passed over.

    The bytes of artifacts are also added to those of the owners, by another one.
    """
    rows = [
        {"of_job": job_id, **{f"add_{name}": added.get(name, 0) for name in _COLUMNS}}
        for job_id, added in sorted(gains.items())
        if any(added.values())
    ]
    if rows:
        session.connection().execute(_ADD, rows)
        add_artifact_bytes(session, {job_id: int(added.get("artifact_bytes", 0)) for job_id, added in gains.items()})


def miscounted(session: Session, statuses: Iterable[JobStatus] = tuple(JobStatus)) -> Sequence[str]:
    """Return the jobs, of those in some statuses, whose task counters differ from their tasks, by one query."""
    counted = {
        status.value: select(func.count())
        .where(Task.job_id == Job.id, Task.status == status)
        .correlate(Job)
        .scalar_subquery()
        for status in TaskStatus
    }
    query = select(Job.id).where(Job.status.in_([*statuses]), _differs(counted))
    return session.scalars(query.order_by(Job.id)).all()


def recount(session: Session, job_id: str) -> bool:
    """Set the task counters of a job from its tasks, and return whether they were wrong."""
    columns = _counted(session, job_id)
    return changed(session, update(Job).where(Job.id == job_id, _differs(columns)).values(columns)) > 0


def _counted(session: Session, job_id: str) -> dict[str, int]:
    rows = session.execute(select(Task.status, func.count()).where(Task.job_id == job_id).group_by(Task.status))
    counted: Counter[TaskStatus] = Counter(dict(rows.all()))
    return {status.value: counted[status] for status in TaskStatus}


def _differs(columns: Mapping[str, int | ScalarSelect[int]]) -> ColumnElement[bool]:
    return or_(*(getattr(Job, name) != n for name, n in columns.items()))
