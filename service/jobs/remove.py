"""An ended job is forgotten: at once for those who ask, in pieces for the database and the store."""

from __future__ import annotations

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from lippmann.job.states import ENDED_JOBS
from lippmann.plan import artifact_names as names
from service.db import events as event_rows
from service.db import tasks as task_rows
from service.db.engine import Database, changed
from service.db.tables import Chore, EventTopic, Job, Task, WorkerFault
from service.errors import JobNotEnded
from service.jobs.state_machine import find_job, set_job
from service.ports import ArtifactStore


def remove_job(session: Session, job_id: str) -> None:
    """Forget an ended job; from now on nobody sees it."""
    row = find_job(session, job_id)
    if row.status not in ENDED_JOBS:
        raise JobNotEnded(f"a job that is {row.status} cannot be removed; cancel it first")
    set_job(session, row, chore=Chore.REMOVE)
    event_rows.announce(session, job_id, EventTopic.JOB, {"id": job_id, "removed": True})


def remove_some(database: Database, store: ArtifactStore, job_id: str) -> bool:
    """Forget one chunk of a job's rows, then its artifacts, then the job; True while there is more."""
    with database.writing() as session:
        chunk = select(Task.sequence).where(Task.job_id == job_id).limit(task_rows.CHUNK).scalar_subquery()
        if changed(session, delete(Task).where(Task.job_id == job_id, Task.sequence.in_(chunk))):
            return True
    store.delete(names.job_artifact(job_id, ""))
    with database.writing() as session:
        changed(session, delete(WorkerFault).where(WorkerFault.job_id == job_id))
        changed(session, delete(Job).where(Job.id == job_id, Job.chore == Chore.REMOVE))
    return False
