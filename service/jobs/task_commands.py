"""The actions of users on a single task that an attempt owns: give it to another slot, or end it."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.states import TaskStatus
from service.db import coordinator as coordinator_rows
from service.db import task_sets
from service.db.tables import Task
from service.errors import TransitionNotAllowed
from service.jobs.completion import settle
from service.jobs.state_machine import find_job, write_drafts
from service.jobs.task_draft import TaskDraft
from service.settings import FailureLimit

ENDED_BY_USER = "ended-by-user"
"""The code of a task that a user has ended."""


def restart_task(session: Session, task: Task, *, now_s: float) -> None:
    """Stop the attempt that owns a task, which runs again, on another worker if there is one.

    Raises
    ------
    TransitionNotAllowed
        If no attempt owns the task.
    """
    draft = _draft(session, task, (TaskStatus.DISPATCHED, TaskStatus.RUNNING))
    failed_on = list(dict.fromkeys([*draft.read.failed_on, *([draft.read.worker] if draft.read.worker else [])]))
    draft.transition(TaskStatus.READY, progress=None, failed_on=failed_on, not_before_s=None)
    coordinator_rows.request_stop(session, [draft.read.attempt], now_s=now_s)
    write_drafts(session, [draft], now_s=now_s)


def end_task(session: Session, task: Task, *, by: str, now_s: float, limit: FailureLimit) -> None:
    """Stop the attempt that runs a task, which fails for good and with it its job; an output fails alone.

    Raises
    ------
    TransitionNotAllowed
        If no attempt runs the task.
    """
    draft = _draft(session, task, (TaskStatus.RUNNING,))
    message = f"{by} has ended the task; skip its frame or retry the job"
    draft.transition(
        TaskStatus.FAILED, permanent=True, ended_s=now_s, progress=None, error_code=ENDED_BY_USER,
        error_message=message, error_frame=draft.read.frame, error_artifact=None,
    )  # fmt: skip
    coordinator_rows.request_stop(session, [draft.read.attempt], now_s=now_s)
    write_drafts(session, [draft], now_s=now_s)
    settle(session, find_job(session, task.job_id), now_s=now_s, limit=limit)


def _draft(session: Session, task: Task, allowed: tuple[TaskStatus, ...]) -> TaskDraft:
    key = (task.job_id, task.sequence)
    state = task_sets.states(session, [key])[key]
    if state.status not in allowed:
        expected = " or ".join(allowed)
        raise TransitionNotAllowed(f"cannot stop a task that is {state.status}; expected one that is {expected}")
    return TaskDraft(state)
