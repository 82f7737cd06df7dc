"""Jobs and tasks as the API returns them, from rows."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy.orm import Session

from lippmann.job.messages.events import LOST
from lippmann.job.states import HELD_TASKS, TaskStatus
from service.api.waits import Outlook, job_waits
from service.db import overview
from service.db import tasks as task_rows
from service.db.tables import EndedAttempt, Job, Task
from service.events.payloads import job_data
from service.ids import task_id
from service.schemas import job as job_schema
from service.schemas import task as task_schema
from service.schemas.answer import utc, utc_or_none
from service.schemas.links import log_url
from service.schemas.wait import Wait


def present_jobs(session: Session, rows: Sequence[Job], outlook: Outlook) -> tuple[job_schema.Job, ...]:
    """Return jobs as the API returns them; this takes a handful of queries for any number of jobs."""
    ids = [row.id for row in rows]
    running_px = task_rows.running_px(session, ids)
    done = task_rows.done_outputs(session, ids)
    skipped = task_rows.skipped_frames(session, [row.id for row in rows if row.skipped])
    waits = job_waits(session, rows, outlook)
    newest = overview.newest_frames(session, [row.id for row in rows if row.frames_done])
    return tuple(
        job_data(
            row,
            running_px=running_px.get(row.id, 0.0),
            done_outputs={output for job_id, output in done if job_id == row.id},
            skipped_frames=skipped.get(row.id, ()),
            wait=waits.get(row.id),
            newest_frame=newest.get(row.id),
        )
        for row in rows
    )


def present_job(session: Session, row: Job, outlook: Outlook) -> job_schema.Job:
    """Return one job as the API returns it."""
    return present_jobs(session, [row], outlook)[0]


def present_task(row: Task, wait: Wait | None) -> task_schema.Task:
    """Return a task as the API returns it."""
    identifier = task_id(row.job_id, row.sequence)
    error = None
    if row.error_code is not None:
        error = task_schema.TaskError(code=row.error_code, message=row.error_message or "", permanent=row.permanent)
    return task_schema.Task(
        id=identifier,
        sequence=row.sequence,
        kind=row.kind,
        status=row.status,
        stage=row.stage,
        needs=row.needs,
        frame=row.frame,
        tile=row.tile,
        output=row.output,
        artifact=row.artifact,
        weight_px=row.weight_px,
        wait=wait,
        progress=row.progress,
        attempt_number=row.attempt_number,
        failures=row.failures,
        losses=row.losses,
        failed_on=tuple(row.failed_on),
        worker=row.worker,
        error=error,
        dispatched_at=utc_or_none(row.dispatched_s),
        started_at=utc_or_none(row.claimed_s),
        ended_at=utc_or_none(row.ended_s),
        cpu_s=row.cpu_s,
        wall_s=row.wall_s,
        cached=row.cached,
        log_url=log_url(row.job_id, identifier) if row.attempt_number else None,
    )


def present_attempt(row: Task, ended: EndedAttempt | None = None) -> task_schema.Attempt:
    """Return an attempt as the API returns it: one that has ended, or else the latest one of the task."""
    error_code = ended.error_code if ended else None if row.status in (*HELD_TASKS, TaskStatus.DONE) else row.error_code
    return task_schema.Attempt(
        task=task_id(row.job_id, row.sequence),
        kind=row.kind,
        frame=row.frame,
        tile=row.tile,
        output=row.output,
        number=ended.number if ended else row.attempt_number,
        status=row.status,
        outcome=_outcome(row.status, error_code, is_ended=ended is not None),
        error_code=error_code,
        worker=ended.worker if ended else row.worker,
        started_at=utc(ended.claimed_s if ended else row.claimed_s or 0.0),
        ended_at=utc_or_none(ended.ended_s if ended else row.ended_s),
    )


def _outcome(status: TaskStatus, error_code: str | None, *, is_ended: bool) -> task_schema.AttemptOutcome:
    if not is_ended and status in HELD_TASKS:
        return task_schema.AttemptOutcome.RUNNING
    if not is_ended and status is TaskStatus.DONE:
        return task_schema.AttemptOutcome.DONE
    if error_code is None:
        return task_schema.AttemptOutcome.STOPPED
    return task_schema.AttemptOutcome.LOST if error_code == LOST else task_schema.AttemptOutcome.FAILED
