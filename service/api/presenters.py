"""Jobs and tasks as the API returns them, from rows."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy.orm import Session

from service.api.waits import Outlook, job_waits
from service.db import overview
from service.db import tasks as task_rows
from service.db.tables import Job, Task
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


def present_attempt(row: Task) -> task_schema.Attempt:
    """Return the latest attempt of a task, which has begun, as the API returns it."""
    return task_schema.Attempt(
        task=task_id(row.job_id, row.sequence),
        kind=row.kind,
        frame=row.frame,
        tile=row.tile,
        output=row.output,
        number=row.attempt_number,
        status=row.status,
        worker=row.worker,
        started_at=utc(row.claimed_s or 0.0),
        ended_at=utc_or_none(row.ended_s),
    )
