"""Invariants of tasks: their statuses, who holds them, and when they wait. All of them are read-only queries."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator
from enum import StrEnum
from typing import Any

from sqlalchemy import ColumnElement, String, func, or_, select, type_coerce
from sqlalchemy.orm import InstrumentedAttribute, Session

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import ENDED_JOBS, HELD_TASKS, JobStatus, TaskStatus
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.tables import BackgroundJob, Job, Task
from service.doctor.finding import Check, Finding, Level, tasks_text

_DOMAINS: tuple[tuple[str, InstrumentedAttribute[Any], type[StrEnum]], ...] = (
    ("status of a job", Job.status, JobStatus),
    ("background job", Job.background_job, BackgroundJob),
    ("status of a task", Task.status, TaskStatus),
    ("kind of a task", Task.kind, TaskKind),
)


def check_domains(session: Session) -> Iterator[Finding]:
    """Yield the values that are no statuses, kinds or background jobs; such rows cannot be read otherwise."""
    for what, column, domain in _DOMAINS:
        value = type_coerce(column, String)
        query = select(value, func.count()).where(value.not_in([member.value for member in domain])).group_by(value)
        for found, count in session.execute(query):
            yield Finding(Check.STATUS_DOMAIN, Level.ERROR, f"{count} rows have {found!r}, which is no {what}")


def check_held(session: Session) -> Iterator[Finding]:
    """Yield the held tasks that no attempt or no worker holds, or whose job has ended."""
    held = Task.status.in_(HELD_TASKS)
    nobody = or_(Task.attempt.is_(None), (Task.status == TaskStatus.RUNNING) & Task.worker.is_(None))
    for job_id, sequences in _by_job(session, held, nobody):
        message = f"{tasks_text(sequences)} are dispatched or running without an attempt or a worker"
        yield Finding(Check.HELD_BY_NOBODY, Level.ERROR, message, job_id, sequences, repairable=True)
    ended = Task.job_id.in_(select(Job.id).where(Job.status.in_(ENDED_JOBS)))
    for job_id, sequences in _by_job(session, held, ended):
        message = f"{tasks_text(sequences)} are dispatched or running although the job has ended"
        yield Finding(Check.HELD_AFTER_END, Level.ERROR, message, job_id, sequences, repairable=True)


def check_attempts(session: Session) -> Iterator[Finding]:
    """Yield the tasks that share an attempt: an attempt owns one task, and each task has another one."""
    twice = select(Task.attempt).where(Task.attempt.is_not(None)).group_by(Task.attempt).having(func.count() > 1)
    held = Task.status.in_(HELD_TASKS)
    for job_id, sequences in _by_job(session, held, Task.attempt.in_(twice)):
        message = f"{tasks_text(sequences)} are held by an attempt that another task has too"
        yield Finding(Check.HELD_TWICE, Level.ERROR, message, job_id, sequences, repairable=True)


def check_dependents(session: Session) -> Iterator[Finding]:
    """Yield the tasks of open jobs that wait although what they need is done, and those that do not wait for it."""
    usable = (Job.status.in_(job_rows.OPEN), Job.background_job.is_(None))
    open_jobs = select(Job.id).where(*usable)
    unfinished = select(Task.job_id, Task.stage).where(
        Task.job_id.in_(open_jobs), Task.status.in_(task_rows.UNSATISFIED)
    )
    stages = {(job_id, stage) for job_id, stage in session.execute(unfinished.distinct())}
    query = select(Task.job_id, Task.needs, Task.status).where(Task.job_id.in_(open_jobs), Task.needs.is_not(None))
    wanted = (TaskStatus.WAITING, TaskStatus.READY, TaskStatus.DISPATCHED)
    stuck: set[tuple[str, str]] = set()
    early: set[tuple[str, str]] = set()
    for job_id, needs, status in session.execute(query.where(Task.status.in_(wanted)).distinct()):
        assert needs is not None  # noqa: S101 - the query excludes it
        if status is TaskStatus.WAITING and (job_id, needs) not in stages:
            stuck.add((job_id, needs))
        elif status is not TaskStatus.WAITING and (job_id, needs) in stages:
            early.add((job_id, needs))
    for job_id, sequences in _needing(session, stuck, (TaskStatus.WAITING,)):
        message = f"{tasks_text(sequences)} wait although what they need is done"
        yield Finding(Check.STUCK, Level.ERROR, message, job_id, sequences, repairable=True)
    for job_id, sequences in _needing(session, early, wanted[1:]):
        message = f"{tasks_text(sequences)} are ready or dispatched although what they need is not done"
        yield Finding(Check.TOO_EARLY, Level.ERROR, message, job_id, sequences, repairable=True)


def _needing(
    session: Session, pairs: Iterable[tuple[str, str]], statuses: Collection[TaskStatus]
) -> Iterator[tuple[str, tuple[int, ...]]]:
    by_job: dict[str, list[str]] = defaultdict(list)
    for job_id, needs in pairs:
        by_job[job_id].append(needs)
    for job_id, needs_of_job in sorted(by_job.items()):
        query = select(Task.sequence).where(Task.job_id == job_id, Task.status.in_(statuses))
        sequences = session.scalars(query.where(Task.needs.in_(needs_of_job)).order_by(Task.sequence))
        yield job_id, tuple(sequences)


def _by_job(session: Session, *conditions: ColumnElement[bool]) -> Iterator[tuple[str, tuple[int, ...]]]:
    by_job: dict[str, list[int]] = defaultdict(list)
    query = select(Task.job_id, Task.sequence).where(*conditions).order_by(Task.job_id, Task.sequence)
    for job_id, sequence in session.execute(query):
        by_job[job_id].append(sequence)
    for job_id, sequences in by_job.items():
        yield job_id, tuple(sequences)
