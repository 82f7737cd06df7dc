"""A job rests: nothing new goes out, orders nobody has claimed come back, what runs ends."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus, TaskStatus
from service.db.tables import Job
from service.errors import MoveNotAllowed
from service.jobs.completion import settle
from service.jobs.release import release
from service.jobs.state_machine import find_job, move_job


def pause_job(session: Session, job_id: str, *, now_s: float) -> Job:
    """Let a job rest."""
    row = move_job(session, find_job(session, job_id), JobStatus.PAUSED)
    release(session, row, to=TaskStatus.READY, now_s=now_s, only=TaskStatus.DISPATCHED)
    return row


def resume_job(session: Session, job_id: str, *, now_s: float, failed_share: float) -> Job:
    """Let a job go on; it may turn out that everything ended while it rested."""
    row = find_job(session, job_id)
    if row.status is not JobStatus.PAUSED:
        # From other statuses the table leads to running too, but by other ways: planning and retry.
        raise MoveNotAllowed(f"a job that is {row.status} cannot become {JobStatus.RUNNING} by resume; only paused can")
    row = move_job(session, row, JobStatus.RUNNING)
    settle(session, row, now_s=now_s, failed_share=failed_share)
    return row
