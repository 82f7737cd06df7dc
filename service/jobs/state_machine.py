"""The state machine of jobs and tasks.

Every transition is guarded twice: by the tables of `lippmann.job.states`, and by the status that the row had when it
was read. The transition of a task changes the counters of its job in the same transaction.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from sqlalchemy import update
from sqlalchemy.orm import Session

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import (
    JOB_ACTIONS,
    JOB_TRANSITIONS,
    TASK_TRANSITIONS,
    JobAction,
    JobStatus,
    TaskStatus,
    actions_for,
)
from service.db import coordinator as coordinator_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.counters import add_to_counters
from service.db.engine import changed
from service.db.tables import Job, Task
from service.errors import JobNotEnded, NotFound, TransitionNotAllowed
from service.events.publish import publish_job, publish_task


def find_job(session: Session, job_id: str) -> Job:
    """Return the row of a job.

    Raises
    ------
    NotFound
        If the job does not exist.
    """
    row = job_rows.job(session, job_id)
    if row is None:
        raise NotFound(f"there is no job {job_id!r}")
    return row


def find_job_for(session: Session, job_id: str, action: JobAction) -> Job:
    """Return the row of a job on which an action is allowed.

    Raises
    ------
    NotFound
        If the job does not exist.
    TransitionNotAllowed, JobNotEnded
        If the action is not allowed in the status of the job.
    """
    row = find_job(session, job_id)
    allowed = JOB_ACTIONS[action].allowed_in
    if action not in actions_for(row.status, row.paused_by):
        error = JobNotEnded if action is JobAction.REMOVE else TransitionNotAllowed
        *most, last = (status.value for status in JobStatus if status in allowed)
        words = f"{', '.join(most)} or {last}" if most else last
        raise error(f"cannot {action} a job that is {row.status}; expected one that is {words}")
    return row


def transition_job(session: Session, row: Job, to: JobStatus, **values: Any) -> Job:
    """Change the status of a job from the one that was read, and publish it.

    Raises
    ------
    TransitionNotAllowed
        If the table has no such transition, or the status changed in the meantime.
    """
    if to not in JOB_TRANSITIONS[row.status]:
        raise TransitionNotAllowed(f"a job that is {row.status} cannot become {to}")
    statement = update(Job).where(Job.id == row.id, Job.status == row.status).values(status=to, **values)
    if changed(session, statement) == 0:
        raise TransitionNotAllowed(f"the job is no longer {row.status}, so it cannot become {to}")
    session.refresh(row)
    publish_job(session, row)
    return row


def set_job(session: Session, row: Job, **values: Any) -> Job:
    """Change other columns of a job than its status."""
    changed(session, update(Job).where(Job.id == row.id).values(**values))
    session.refresh(row)
    return row


def transition_task(session: Session, task: Task, to: TaskStatus, **values: Any) -> bool:
    """Change the status of a task from the one that was read, and refresh `task`.

    Returns
    -------
    bool
        False if status or attempt of the row changed in the meantime; then nothing is written.

    Raises
    ------
    ValueError
        If the table has no such transition.
    """
    _check(task.status, to)
    statement = (
        update(Task)
        .where(Task.job_id == task.job_id, Task.sequence == task.sequence)
        .where(Task.status == task.status, Task.attempt.is_not_distinct_from(task.attempt))
        .values(status=to, **values)
    )
    if changed(session, statement) == 0:
        return False
    add_to_counters(session, task.job_id, {task.status: -1, to: 1}, **_gains(task, to, values))
    session.refresh(task)
    return True


def transition_tasks(
    session: Session, job_id: str, sequences: Iterable[int], was: TaskStatus, to: TaskStatus, **values: Any
) -> int:
    """Change the status of those tasks that are still `was`, and return their number."""
    _check(was, to)
    wanted = list(sequences)
    if not wanted:
        return 0
    statement = (
        update(Task)
        .where(Task.job_id == job_id, Task.sequence.in_(wanted), Task.status == was)
        .values(status=to, **values)
    )
    count = changed(session, statement)
    add_to_counters(session, job_id, {was: -count, to: count})
    return count


def release_tasks(session: Session, row: Job, *, to: TaskStatus, now_s: float, only: TaskStatus | None = None) -> None:
    """Take the held tasks of a job (`only` those of one status) from their attempts, and request that these stop."""
    held = task_rows.held(session, [row.id], status=only)
    coordinator_rows.request_stop(session, [task.attempt for task in held], now_s=now_s)
    for task in held:
        ended_s = now_s if to is TaskStatus.CANCELLED else None
        if transition_task(session, task, to, progress=None, ended_s=ended_s):
            publish_task(session, task)
    session.refresh(row)


def _check(was: TaskStatus, to: TaskStatus) -> None:
    if to not in TASK_TRANSITIONS[was]:
        raise ValueError(f"expected a transition of the table, got task {was} -> {to}")


def _gains(task: Task, to: TaskStatus, values: Mapping[str, Any]) -> dict[str, float]:
    if to is not TaskStatus.DONE:
        return {}
    gains: dict[str, float] = {name: values[name] for name in ("cpu_s", "wall_s") if values.get(name)}
    gains["done_px"] = task.weight_px
    gains["frames_done"] = 1 if task.kind is TaskKind.ASSEMBLE else 0
    return gains
