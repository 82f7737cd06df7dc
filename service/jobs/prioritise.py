"""A job goes sooner or later than it did."""

from __future__ import annotations

from sqlalchemy.orm import Session

from service.db.tables import Job
from service.events.publish import tell_job
from service.jobs.state_machine import find_job, set_job


def prioritise_job(session: Session, job_id: str, priority: int) -> Job:
    """Set a job's priority; what is in the queue already stays there, and the queue is shallow."""
    row = set_job(session, find_job(session, job_id), priority=priority)
    tell_job(session, row)
    return row
