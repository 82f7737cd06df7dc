"""Queries on attempts: the latest one of each task, and those before that ended without their tasks being done."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sqlalchemy import and_, bindparam, delete, func, select, text
from sqlalchemy.engine import Row
from sqlalchemy.orm import Session

from service.db.tables import EndedAttempt, Task
from service.db.task_state import TaskState

KEPT = 20
"""The number of the last attempts of a task that are kept."""

_KEEP = text(
    "INSERT INTO ended_attempts (job_id, sequence, number, worker, claimed_s, ended_s, error_code) "
    "SELECT job_id, sequence, attempt_number, worker, claimed_s, "
    "CAST(:ended_s AS DOUBLE PRECISION), CAST(:error_code AS VARCHAR(64)) "
    "FROM tasks WHERE job_id = :of_job AND sequence = :of_sequence AND claimed_s IS NOT NULL ON CONFLICT DO NOTHING"
)
_IS_OF_TASK = and_(Task.job_id == EndedAttempt.job_id, Task.sequence == EndedAttempt.sequence)
_FORGET = delete(EndedAttempt).where(
    EndedAttempt.job_id == bindparam("of_job"), EndedAttempt.sequence == bindparam("of_sequence"),
    EndedAttempt.number <= bindparam("before"),
)  # fmt: skip


class Ended(NamedTuple):
    """An attempt that has ended without its task being done."""

    task: TaskState
    error_code: str | None
    """The code of its error; None if it was stopped."""


def keep(session: Session, attempts: Sequence[Ended], *, ended_s: float) -> None:
    """Store attempts that have ended, each once; those that no worker had claimed are left out."""
    if not attempts:
        return
    keys = [{"of_job": task.job_id, "of_sequence": task.sequence} for task, _ in attempts]
    codes = [{"error_code": code, "ended_s": ended_s} for _, code in attempts]
    session.connection().execute(_KEEP, [key | more for key, more in zip(keys, codes, strict=True)])
    numbers = [task.attempt_number - KEPT for task, _ in attempts]
    old = [key | {"before": number} for key, number in zip(keys, numbers, strict=True) if number > 0]
    if old:
        session.connection().execute(_FORGET, old)


def latest(session: Session, job_id: str, *, limit: int) -> Sequence[Task]:
    """Return the tasks whose latest attempt has begun, the one that began last first."""
    query = select(Task).where(Task.job_id == job_id, Task.claimed_s.is_not(None))
    return session.scalars(query.order_by(Task.claimed_s.desc(), Task.sequence.desc()).limit(limit)).all()


def ended(session: Session, job_id: str, *, limit: int) -> Sequence[Row[EndedAttempt, Task]]:
    """Return attempts that ended without their tasks being done, with their tasks, the one that began last first."""
    query = select(EndedAttempt, Task).join(Task, _IS_OF_TASK).where(EndedAttempt.job_id == job_id)
    order = (EndedAttempt.claimed_s.desc(), EndedAttempt.sequence.desc(), EndedAttempt.number.desc())
    return session.execute(query.order_by(*order).limit(limit)).all()


def count(session: Session, job_id: str) -> int:
    """Return the number of attempts that are stored: the latest ones that have begun, and those before them."""
    has_begun = select(func.count()).select_from(Task).where(Task.job_id == job_id, Task.claimed_s.is_not(None))
    is_latest = and_(Task.attempt_number == EndedAttempt.number, Task.claimed_s.is_not(None))
    before = select(func.count()).select_from(EndedAttempt).join(Task, _IS_OF_TASK)
    before = before.where(EndedAttempt.job_id == job_id, ~is_latest)
    return int(session.scalar(has_begun) or 0) + int(session.scalar(before) or 0)
