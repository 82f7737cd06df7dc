"""The actions of users on jobs: cancel, pause, resume, retry, repair, skip, prioritise, share, remove.

`lippmann.job.states.JOB_ACTIONS` defines in which statuses each of them is allowed. A request changes what it can in
one transaction; work on many rows is left to a background job, whose chunks are the functions `*_chunk`.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from lippmann.job.states import JobAction, JobStatus, PausedBy, TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.artifact_store import ArtifactStore
from service.db import tasks as task_rows
from service.db.counters import add_to_counters
from service.db.engine import Database, changed
from service.db.tables import BackgroundJob, EndedAttempt, Job, Task, WorkerFault
from service.events.publish import publish_jobs, publish_removal
from service.jobs.completion import settle
from service.jobs.farm_pause import NOT_PAUSED, forget_faults
from service.jobs.skipping import bring_back, skip
from service.jobs.state_machine import (
    RESET,
    find_job,
    find_job_for,
    release_tasks,
    set_job,
    transition_job,
    transition_tasks,
)
from service.settings import FailureLimit

_NOT_ENDED = {"ended_s": None, "error_code": None, "error_message": None}
"""The columns of a job that a retry and a repair reset."""


def cancel_job(session: Session, job_id: str, *, now_s: float) -> Job:
    """Cancel a job: running attempts are stopped, and tasks that are done stay done."""
    row = find_job_for(session, job_id, JobAction.CANCEL)
    ended = {"ended_s": now_s, "background_job": BackgroundJob.CANCEL, **NOT_PAUSED}
    row = transition_job(session, row, JobStatus.CANCELLED, **ended)
    release_tasks(session, row, to=TaskStatus.CANCELLED, now_s=now_s)
    cancel_chunk(session, row, now_s=now_s)
    return row


def cancel_chunk(session: Session, row: Job, *, now_s: float) -> bool:
    """Cancel one chunk of the tasks that have not begun; return whether there are more."""
    open_tasks = task_rows.in_statuses(session, row.id, [TaskStatus.WAITING, TaskStatus.READY])
    for status in (TaskStatus.WAITING, TaskStatus.READY):
        sequences = [sequence for sequence, was in open_tasks if was is status]
        transition_tasks(session, row.id, sequences, status, TaskStatus.CANCELLED, ended_s=now_s)
    more = len(open_tasks) == task_rows.CHUNK
    set_job(session, row, background_job=BackgroundJob.CANCEL if more else None)
    return more


def pause_job(session: Session, job_id: str, *, now_s: float) -> Job:
    """Pause a job: orders that no worker has claimed are taken back, and running tasks finish."""
    row = find_job_for(session, job_id, JobAction.PAUSE)
    by_user = {**NOT_PAUSED, "paused_by": PausedBy.USER, "paused_s": now_s}
    if row.status is JobStatus.PAUSED:  # by the farm, so that nothing is dispatched
        row = set_job(session, row, **by_user)
        publish_jobs(session, [row])
        return row
    row = transition_job(session, row, JobStatus.PAUSED, **by_user)
    release_tasks(session, row, to=TaskStatus.READY, now_s=now_s, only=TaskStatus.DISPATCHED)
    return row


def resume_job(session: Session, job_id: str, *, now_s: float, limit: FailureLimit) -> Job:
    """Resume a paused job; it ends at once if its last tasks ended during the pause.

    A job that the farm has paused is tried again at once; it is paused again if the cause is still there.
    """
    row = find_job_for(session, job_id, JobAction.RESUME)
    forget_faults(session, job_id)
    row = transition_job(session, row, JobStatus.RUNNING, **NOT_PAUSED)
    settle(session, row, now_s=now_s, limit=limit)
    return row


def prioritise_job(session: Session, job_id: str, priority: int) -> Job:
    """Set the priority of a job; orders that were already sent keep their place in the queue."""
    row = set_job(session, find_job_for(session, job_id, JobAction.PRIORITISE), priority=priority)
    publish_jobs(session, [row])
    return row


def share_job(session: Session, job_id: str, *, shared: bool) -> Job:
    """Show a job to all owners, or hide it again where jobs are hidden from other owners."""
    row = set_job(session, find_job(session, job_id), shared=shared)
    publish_jobs(session, [row])
    return row


def retry_job(session: Session, job_id: str, *, now_s: float, limit: FailureLimit) -> Job:
    """Continue a job with the tasks that are not done, also those of skipped frames; all failures are reset."""
    row = find_job_for(session, job_id, JobAction.RETRY)
    if row.skipped:
        bring_back(session, row)
    return _continue_job(session, row, now_s=now_s, limit=limit)


def skip_frames(
    session: Session, job_id: str, frames: Collection[int] | None, *, now_s: float, limit: FailureLimit
) -> Job:
    """Leave frames of a failed or cancelled job out, by default those that failed, and continue it as a retry does."""
    row = find_job_for(session, job_id, JobAction.SKIP)
    skip(session, row, frames, now_s=now_s)
    return _continue_job(session, row, now_s=now_s, limit=limit)


def _continue_job(session: Session, row: Job, *, now_s: float, limit: FailureLimit) -> Job:
    changed(session, delete(WorkerFault).where(WorkerFault.job_id == row.id))
    row = transition_job(session, row, JobStatus.RUNNING, **_NOT_ENDED, background_job=BackgroundJob.RETRY)
    retry_chunk(session, row, now_s=now_s, limit=limit)
    return row


def repair_job(session: Session, job_id: str) -> Job:
    """Verify every artifact of an ended job and make the damaged ones again; then continue it as a retry does."""
    row = find_job_for(session, job_id, JobAction.REPAIR)
    changed(session, delete(WorkerFault).where(WorkerFault.job_id == job_id))
    changed(session, update(Task).where(Task.job_id == job_id, Task.repairs > 0).values(repairs=0))
    return transition_job(session, row, JobStatus.RUNNING, **_NOT_ENDED, background_job=BackgroundJob.VERIFY)


def retry_chunk(session: Session, row: Job, *, now_s: float, limit: FailureLimit) -> bool:
    """Reset one chunk of failed and cancelled tasks; return whether there are more."""
    chunk = task_rows.retriable(session, row.id)
    groups: dict[tuple[TaskStatus, TaskStatus], list[int]] = defaultdict(list)
    for sequence, status, blocked in chunk:
        groups[status, TaskStatus.WAITING if blocked else TaskStatus.READY].append(sequence)
    for (status, to), sequences in groups.items():
        transition_tasks(session, row.id, sequences, status, to, **RESET)
    more = len(chunk) == task_rows.CHUNK
    set_job(session, row, background_job=BackgroundJob.RETRY if more else _after_retry(row))
    if row.background_job is None:
        settle(session, row, now_s=now_s, limit=limit)
    return row.background_job is not None


def remove_job(session: Session, job_id: str) -> None:
    """Remove an ended job; from now on the API does not return it."""
    row = find_job_for(session, job_id, JobAction.REMOVE)
    set_job(session, row, background_job=BackgroundJob.REMOVE)
    publish_removal(session, job_id)


def remove_chunk(database: Database, store: ArtifactStore, job_id: str) -> bool:
    """Delete a removed job's artifacts, then one chunk of its tasks, at last the job; return whether there is more.

    The artifacts go first, because a job may be removed to make room on a disk that has none left for the database.
    """
    store.delete(names.job_artifact(job_id, ""))
    with database.writing() as session:
        row = session.get(Job, job_id, populate_existing=True)
        add_to_counters(session, {job_id: {"artifact_bytes": 0 if row is None else -row.artifact_bytes}})
        chunk = select(Task.sequence).where(Task.job_id == job_id).limit(task_rows.CHUNK).scalar_subquery()
        if changed(session, delete(Task).where(Task.job_id == job_id, Task.sequence.in_(chunk))):
            return True
    with database.writing() as session:
        changed(session, delete(EndedAttempt).where(EndedAttempt.job_id == job_id))
        changed(session, delete(WorkerFault).where(WorkerFault.job_id == job_id))
        changed(session, delete(Job).where(Job.id == job_id, Job.background_job == BackgroundJob.REMOVE))
    return False


def _after_retry(row: Job) -> BackgroundJob | None:
    return BackgroundJob.PLAN if row.probe is not None and row.planned_s is None else None
