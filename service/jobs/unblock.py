"""Tasks whose needs are done become ready. No counters: what is not done is asked each time."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.states import TaskStatus
from service.db import tasks as task_rows
from service.db.counters import move_tasks
from service.db.tables import Task


def unblock(session: Session, done: Task) -> int:
    """Make ready what waited for the stage of a task that has just been done; returns how many."""
    if not task_rows.stage_is_done(session, done.job_id, done.stage):
        return 0
    waiting = task_rows.waiting_for(session, done.job_id, done.stage)
    return move_tasks(session, done.job_id, waiting, TaskStatus.WAITING, TaskStatus.READY)
