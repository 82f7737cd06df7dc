"""Takes tasks away from the attempts that hold them, and has the attempts told to stop."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.states import TaskStatus
from service.db import coordinator as clerk_rows
from service.db import tasks as task_rows
from service.db.counters import move_task
from service.db.tables import Job
from service.events.publish import tell_task


def release(session: Session, row: Job, *, to: TaskStatus, now_s: float, only: TaskStatus | None = None) -> None:
    """Move a job's held tasks (`only` those of one status); the shallow queue keeps them few."""
    held = task_rows.held(session, [row.id], status=only)
    clerk_rows.stop(session, [task.attempt for task in held], now_s=now_s)
    for task in held:
        ended_s = now_s if to is TaskStatus.CANCELLED else None
        if move_task(session, task, to, progress=None, ended_s=ended_s):
            tell_task(session, task)
    session.refresh(row)
