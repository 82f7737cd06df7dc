"""The farm pauses jobs whose work something prevents, such as a full disk, and they go on when it has gone.

A user's pause and the farm's are told apart by `Job.paused_by`. The farm never resumes a job that a user paused.
"""

from __future__ import annotations

from sqlalchemy import delete, update
from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, PausedBy, TaskStatus
from service.db.engine import changed
from service.db.tables import Job, Task, WorkerFault
from service.events.publish import publish_jobs
from service.jobs.completion import settle
from service.jobs.state_machine import release_tasks, set_job, transition_job
from service.settings import FailureLimit

NOT_PAUSED = {"paused_by": None, "pause_code": None, "pause_reason": None, "paused_s": None}
"""The columns of a job that is not paused."""


def pause_for_farm(session: Session, row: Job, *, code: str, reason: str, now_s: float) -> None:
    """Pause a job for a reason; orders that no worker has claimed are taken back.

    A job that the farm has paused before only gets the reason.
    """
    values = {"pause_code": code, "pause_reason": reason}
    if row.status is JobStatus.PAUSED:
        if row.paused_by is PausedBy.FARM and row.pause_reason != reason:
            publish_jobs(session, [set_job(session, row, **values)])
        return
    row = transition_job(session, row, JobStatus.PAUSED, **values, paused_by=PausedBy.FARM, paused_s=now_s)
    release_tasks(session, row, to=TaskStatus.READY, now_s=now_s, only=TaskStatus.DISPATCHED)


def resume_for_farm(session: Session, row: Job, *, is_repaired: bool, now_s: float, limit: FailureLimit) -> None:
    """Let a job go on that the farm has paused; if the cause `is_repaired`, no worker is avoided for it any longer."""
    if row.status is not JobStatus.PAUSED or row.paused_by is not PausedBy.FARM:
        return
    if is_repaired:
        forget_faults(session, row.id)
    settle(session, transition_job(session, row, JobStatus.RUNNING, **NOT_PAUSED), now_s=now_s, limit=limit)


def forget_faults(session: Session, job_id: str) -> None:
    """Let deferred tasks be dispatched at once, also to the workers on which they could not be done."""
    changed(session, delete(WorkerFault).where(WorkerFault.job_id == job_id, WorkerFault.code.is_not(None)))
    deferred = update(Task).where(Task.job_id == job_id, Task.status == TaskStatus.READY, Task.deferrals > 0)
    changed(session, deferred.values(deferrals=0, not_before_s=None))
