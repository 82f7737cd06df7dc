"""Queries on the work of the farm: the tasks of now, the jobs that wait, the last hours, and what owners use."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from sqlalchemy import ColumnElement, Integer, Row, Select, SQLColumnExpression, and_, case, cast, func, or_, select
from sqlalchemy.orm import Session

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import HELD_TASKS, JobStatus, TaskStatus
from service.db.jobs import IS_BUSY, OPEN, is_seen_by
from service.db.tables import Job, Scene, Task

MOST_OWNERS = 1000
"""The largest number of owners with their names that are listed."""

Span = tuple[int, int, int, float, float]
"""Tasks that began in the same step and ended in the same one: these two steps, the number of tasks, and the sums of
the times at which they began and ended, in seconds since the first step."""


def busy_jobs(session: Session, *, owner_id: str | None) -> Sequence[Job]:
    """Return the open jobs with outstanding orders, only those that an owner sees if one is given."""
    query = select(Job).where(IS_BUSY, Job.status.in_(OPEN))
    return session.scalars(_seen(query, owner_id).order_by(Job.id)).all()


def held_tasks(session: Session, job_ids: Iterable[str], *, limit: int) -> Sequence[Task]:
    """Return the tasks of some jobs that an attempt owns, those that run longest first."""
    query = select(Task).where(Task.job_id.in_([*job_ids]), Task.status.in_(HELD_TASKS))
    return session.scalars(
        query.order_by(Task.claimed_s.is_(None), Task.claimed_s, Task.dispatched_s).limit(limit)
    ).all()


def newest_frame(session: Session, job_id: str) -> int | None:
    """Return the last frame of a job, in the order of its tasks, that is done."""
    query = select(Task.frame).where(Task.job_id == job_id, Task.status == TaskStatus.DONE)
    query = query.where(Task.kind == TaskKind.ASSEMBLE)
    return session.scalar(query.order_by(Task.sequence.desc()).limit(1))


def scenes_with_posters(session: Session, names: Iterable[str]) -> set[str]:
    """Return those scenes that have a poster."""
    return {*session.scalars(select(Scene.name).where(Scene.name.in_([*names]), Scene.poster.is_not(None)))}


def waiting_jobs(session: Session, *, owner_id: str | None, limit: int) -> Sequence[Job]:
    """Return open jobs of which no task runs, and paused ones, oldest first."""
    query = select(Job).where(Job.status.in_(OPEN), or_(Job.running == 0, Job.status == JobStatus.PAUSED))
    return session.scalars(_seen(query, owner_id).order_by(Job.id).limit(limit)).all()


def finished_frames(session: Session, *, begin_s: float, step_s: float) -> dict[int, int]:
    """Return the number of frames that were finished in each step since a time."""
    step = _step(session, Task.ended_s, begin_s, step_s)
    # As a condition, the status would lead SQLite to an index of jobs.
    is_frame = and_(Task.kind == TaskKind.ASSEMBLE, Task.status == TaskStatus.DONE)
    query = select(step, func.sum(case((is_frame, 1), else_=0))).where(Task.ended_s >= begin_s).group_by(step)
    return {number: int(count) for number, count in session.execute(query) if count}


def spans(session: Session, *, begin_s: float, step_s: float) -> Sequence[Span]:
    """Return the times in which tasks held slots that ended since a time, and that began before or after it."""
    claimed_s = case((Task.claimed_s < begin_s, begin_s), else_=Task.claimed_s)
    first, last = _step(session, claimed_s, begin_s, step_s), _step(session, Task.ended_s, begin_s, step_s)
    query = select(first, last, func.count(), func.sum(claimed_s - begin_s), func.sum(Task.ended_s - begin_s))
    query = query.where(Task.ended_s >= begin_s, Task.claimed_s <= Task.ended_s)
    return [
        (int(begun), int(ended), int(count), float(sum_begun), float(sum_ended))
        for begun, ended, count, sum_begun, sum_ended in session.execute(query.group_by(first, last))
    ]


def owners(session: Session, *, owner_id: str | None) -> Sequence[Row[str, str, int, int, int, int, float, int]]:
    """Return owner, name, jobs, open jobs, running tasks, frames, CPU seconds and bytes, the most CPU time first."""
    is_open = case((Job.status.in_(OPEN), 1), else_=0)
    cpu_s = func.sum(Job.cpu_s)
    query = select(
        Job.owner_id, Job.owner, func.count(), func.sum(is_open), func.sum(Job.running), func.sum(Job.frames_done),
        cpu_s, func.sum(Job.artifact_bytes),
    )  # fmt: skip
    if owner_id is not None:
        query = query.where(Job.owner_id == owner_id)
    query = query.group_by(Job.owner_id, Job.owner).order_by(cpu_s.desc(), Job.owner_id, Job.owner)
    return session.execute(query.limit(MOST_OWNERS)).all()


def _seen(query: Select[Job], owner_id: str | None) -> Select[Job]:
    return query if owner_id is None else query.where(is_seen_by(owner_id))


def _step(session: Session, time_s: SQLColumnExpression[Any], begin_s: float, step_s: float) -> ColumnElement[int]:
    """Return the number of the step in which a time lies."""
    steps = (time_s - begin_s) / step_s
    # SQLite may come without `floor`, and its cast cuts; the cast of PostgreSQL rounds.
    return cast(steps if session.get_bind().dialect.name == "sqlite" else func.floor(steps), Integer)
