"""Invariants of jobs: counters, plans and ends. All of them are read-only queries."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import SATISFIED_TASKS, JobStatus, TaskStatus
from service.db.tables import Job, Task
from service.doctor.finding import Check, Finding, Level
from service.jobs.completion import has_ended
from service.settings import Settings

_BEGUN = (JobStatus.PROBING, JobStatus.RUNNING, JobStatus.PAUSED)
_PAGE = 500


@dataclass
class Counts:
    """The counts of the tasks of a job."""

    statuses: Counter[TaskStatus] = field(default_factory=Counter)
    total_px: int = 0
    done_px: int = 0
    frames: int = 0
    frames_done: int = 0
    highest: int = 0
    """The highest sequence number."""

    @property
    def tasks(self) -> int:
        """The number of tasks."""
        return self.statuses.total()


def check_jobs(session: Session, settings: Settings) -> Iterator[Finding]:
    """Yield everything that is wrong with the rows of jobs; those that are being removed are passed over."""
    counted = count_tasks(session)
    after = ""
    query = select(Job).order_by(Job.id).limit(_PAGE)
    while page := session.scalars(query.where(Job.id > after)).all():
        after = page[-1].id
        for row in page:
            if row.background_job is None:
                yield from _check_job(session, row, counted.get(row.id, Counts()), settings)


def count_tasks(session: Session, job_id: str | None = None) -> Mapping[str, Counts]:
    """Count the tasks of every job, or of one, in one pass."""
    counted: dict[str, Counts] = defaultdict(Counts)
    query = select(
        Task.job_id, Task.status, Task.kind, func.count(), func.sum(Task.weight_px), func.max(Task.sequence)
    ).group_by(Task.job_id, Task.status, Task.kind)
    if job_id is not None:
        query = query.where(Task.job_id == job_id)
    for job, status, kind, count, weight_px, highest in session.execute(query):
        counts = counted[job]
        counts.statuses[status] += count
        counts.total_px += int(weight_px) if status is not TaskStatus.SKIPPED else 0
        counts.highest = max(counts.highest, highest)
        counts.frames += count if kind is TaskKind.ASSEMBLE else 0
        if status is TaskStatus.DONE:
            counts.done_px += int(weight_px)
            counts.frames_done += count if kind is TaskKind.ASSEMBLE else 0
    return counted


def _check_job(session: Session, row: Job, counts: Counts, settings: Settings) -> Iterator[Finding]:
    yield from _check_counters(row, counts)
    if row.planned_s is not None and (counts.tasks != counts.highest + 1 or counts.frames != row.frames_total):
        message = (
            f"expected tasks 0 to {counts.highest} with {row.frames_total} frames, "
            f"got {counts.tasks} tasks with {counts.frames} frames"
        )
        yield Finding(Check.PLAN, Level.ERROR, message, row.id)
    if row.status in _BEGUN and row.planned_s is None and row.probe is not None:
        message = "the probe is done, but no background job plans the tasks"
        yield Finding(Check.UNPLANNED, Level.ERROR, message, row.id, repairable=True)
    if row.status in _BEGUN and row.probe is None and counts.statuses[TaskStatus.DONE]:
        message = "tasks are done, but the measurements of the probe are missing"
        yield Finding(Check.UNPLANNED, Level.ERROR, message, row.id, (0,), repairable=counts.tasks == 1)
    if has_ended(session, row, limit=settings.failure_limit):
        message = f"the job is {row.status} although its tasks have ended"
        yield Finding(Check.NOT_ENDED, Level.ERROR, message, row.id, repairable=True)
    unfinished = counts.tasks - sum(counts.statuses[status] for status in SATISFIED_TASKS)
    if row.status is JobStatus.DONE and unfinished:
        yield Finding(Check.DONE_INCOMPLETE, Level.ERROR, f"the job is done, but {unfinished} tasks are not", row.id)


def _check_counters(row: Job, counts: Counts) -> Iterator[Finding]:
    wrong = [
        f"{status} {getattr(row, status.value)} instead of {counts.statuses[status]}"
        for status in TaskStatus
        if getattr(row, status.value) != counts.statuses[status]
    ]
    if wrong:
        message = f"the counters differ from the tasks: {', '.join(wrong)}"
        yield Finding(Check.COUNTERS, Level.ERROR, message, row.id, repairable=True)
    pairs = {name: (getattr(row, name), getattr(counts, name)) for name in ("total_px", "done_px", "frames_done")}
    wrong = [f"{name} {stored} instead of {right}" for name, (stored, right) in pairs.items() if stored != right]
    if wrong:
        message = f"the progress differs from the tasks: {', '.join(wrong)}"
        yield Finding(Check.PROGRESS, Level.ERROR, message, row.id, repairable=True)
