"""Guarded moves of tasks, and the numbers in the job's row that move along in the same transaction."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

from sqlalchemy import ColumnElement, func, or_, select, update
from sqlalchemy.orm import Session

from lippmann.job.orders import TaskKind
from lippmann.job.states import TASK_MOVES, TaskStatus
from service.db.engine import changed
from service.db.tables import Job, Task


def move_task(session: Session, task: Task, to: TaskStatus, **values: Any) -> bool:
    """Move one task as it was read; False if it is no longer so. `task` then says what the row says.

    Raises
    ------
    ValueError
        If the table of moves does not allow it.
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
    gains = _gains(task, to, values)
    shift(session, task.job_id, {task.status: -1, to: 1}, **gains)
    session.refresh(task)
    return True


def move_tasks(
    session: Session, job_id: str, sequences: Iterable[int], was: TaskStatus, to: TaskStatus, **values: Any
) -> int:
    """Move the tasks that still stand at `was`, and return how many did."""
    _check(was, to)
    wanted = list(sequences)
    if not wanted:
        return 0
    statement = (
        update(Task)
        .where(Task.job_id == job_id, Task.sequence.in_(wanted), Task.status == was)
        .values(status=to, **values)
    )
    moved = changed(session, statement)
    shift(session, job_id, {was: -moved, to: moved})
    return moved


def shift(session: Session, job_id: str, tasks: Mapping[TaskStatus, int], **gains: float) -> None:
    """Add to the numbers in a job's row."""
    columns = {getattr(Job, status.value): n for status, n in tasks.items() if n}
    columns |= {getattr(Job, name): n for name, n in gains.items() if n}
    if columns:
        values = {column.key: column + n for column, n in columns.items()}
        changed(session, update(Job).where(Job.id == job_id).values(values))


def is_miscounted(session: Session, job_id: str) -> bool:
    """Return whether a job's row is wrong about its tasks."""
    return (
        session.execute(select(Job.id).where(Job.id == job_id, _wrong(_counted(session, job_id)))).first() is not None
    )


def recount(session: Session, job_id: str) -> bool:
    """Count a job's tasks again, and return whether the row had been wrong."""
    columns = _counted(session, job_id)
    return changed(session, update(Job).where(Job.id == job_id, _wrong(columns)).values(columns)) > 0


def _counted(session: Session, job_id: str) -> dict[str, int]:
    rows = session.execute(select(Task.status, func.count()).where(Task.job_id == job_id).group_by(Task.status))
    counted: Counter[TaskStatus] = Counter(dict(rows.all()))
    return {status.value: counted[status] for status in TaskStatus}


def _wrong(columns: Mapping[str, int]) -> ColumnElement[bool]:
    return or_(*(getattr(Job, name) != n for name, n in columns.items()))


def _check(was: TaskStatus, to: TaskStatus) -> None:
    if to not in TASK_MOVES[was]:
        raise ValueError(f"expected a move that the table allows, got task {was} -> {to}")


def _gains(task: Task, to: TaskStatus, values: Mapping[str, Any]) -> dict[str, float]:
    gains = {name: values[name] for name in ("cpu_s", "wall_s") if values.get(name) and to is TaskStatus.DONE}
    if to is TaskStatus.DONE:
        gains["done_px"] = task.weight_px
        gains["frames_done"] = 1 if task.kind is TaskKind.ASSEMBLE else 0
    return gains
