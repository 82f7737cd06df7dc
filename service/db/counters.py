"""The counters in the row of a job: tasks by status, frames, pixels and seconds.

A transition of a task changes them in its own transaction, see `service.jobs.state_machine`.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from sqlalchemy import ColumnElement, func, or_, select, update
from sqlalchemy.orm import Session

from lippmann.job.states import TaskStatus
from service.db.engine import changed
from service.db.tables import Job, Task


def add_to_counters(session: Session, job_id: str, tasks: Mapping[TaskStatus, int], **gains: float) -> None:
    """Add to the counters of a job: `tasks` by status, and other columns by name."""
    columns = {getattr(Job, status.value): n for status, n in tasks.items() if n}
    columns |= {getattr(Job, name): n for name, n in gains.items() if n}
    if columns:
        values = {column.key: column + n for column, n in columns.items()}
        changed(session, update(Job).where(Job.id == job_id).values(values))


def is_miscounted(session: Session, job_id: str) -> bool:
    """Return whether the task counters of a job differ from its tasks."""
    differs = _differs(_counted(session, job_id))
    return session.execute(select(Job.id).where(Job.id == job_id, differs)).first() is not None


def recount(session: Session, job_id: str) -> bool:
    """Set the task counters of a job from its tasks, and return whether they were wrong."""
    columns = _counted(session, job_id)
    return changed(session, update(Job).where(Job.id == job_id, _differs(columns)).values(columns)) > 0


def _counted(session: Session, job_id: str) -> dict[str, int]:
    rows = session.execute(select(Task.status, func.count()).where(Task.job_id == job_id).group_by(Task.status))
    counted: Counter[TaskStatus] = Counter(dict(rows.all()))
    return {status.value: counted[status] for status in TaskStatus}


def _differs(columns: Mapping[str, int]) -> ColumnElement[bool]:
    return or_(*(getattr(Job, name) != n for name, n in columns.items()))
