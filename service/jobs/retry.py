"""A failed or cancelled job goes on with only what is not done, every failure forgiven."""

from __future__ import annotations

from collections import defaultdict

from sqlalchemy import delete
from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, TaskStatus
from service.db import tasks as task_rows
from service.db.counters import move_tasks
from service.db.engine import changed
from service.db.tables import Chore, Job, WorkerFault
from service.errors import MoveNotAllowed
from service.jobs.completion import settle
from service.jobs.state_machine import find_job, move_job, set_job

_FORGIVEN = {
    "failures": 0,
    "failed_on": [],
    "rests": 0,
    "error_code": None,
    "error_message": None,
    "permanent": False,
    "not_before_s": None,
    "ended_s": None,
}


def retry_job(session: Session, job_id: str, *, now_s: float, failed_share: float) -> Job:
    """Let an ended job go on."""
    row = find_job(session, job_id)
    if row.status not in (JobStatus.FAILED, JobStatus.CANCELLED):
        raise MoveNotAllowed(
            f"a job that is {row.status} cannot become {JobStatus.RUNNING} by retry; only failed or cancelled can"
        )
    changed(session, delete(WorkerFault).where(WorkerFault.job_id == job_id))
    forgiven = {"ended_s": None, "error_code": None, "error_message": None, "chore": Chore.RETRY}
    row = move_job(session, row, JobStatus.RUNNING, **forgiven)
    retry_some(session, row, now_s=now_s, failed_share=failed_share)
    return row


def retry_some(session: Session, row: Job, *, now_s: float, failed_share: float) -> bool:
    """Bring back one chunk of failed and cancelled tasks; True while there is more."""
    chunk = task_rows.retriable(session, row.id)
    groups: dict[tuple[TaskStatus, TaskStatus], list[int]] = defaultdict(list)
    for sequence, status, blocked in chunk:
        groups[status, TaskStatus.WAITING if blocked else TaskStatus.READY].append(sequence)
    for (status, to), sequences in groups.items():
        move_tasks(session, row.id, sequences, status, to, **_FORGIVEN)
    more = len(chunk) == task_rows.CHUNK
    set_job(session, row, chore=Chore.RETRY if more else _next(row))
    if row.chore is None:
        settle(session, row, now_s=now_s, failed_share=failed_share)
    return row.chore is not None


def _next(row: Job) -> Chore | None:
    return Chore.PLAN if row.probe is not None and row.planned_s is None else None
