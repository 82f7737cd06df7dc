"""A job or task as the API says it, from rows."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache

from sqlalchemy.orm import Session

from lippmann.job.orders import TileIndex
from lippmann.job.spec import JobSpec
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import frame_size
from service.db import tasks as task_rows
from service.db.tables import Job, Task
from service.ids import task_id
from service.schemas import job as job_schema
from service.schemas import task as task_schema
from service.schemas.answer import utc, utc_or_none

API = "/api/v1"


def artifact_url(job_id: str, name: str) -> str:
    """Return where an artifact of a job is."""
    return f"{API}/jobs/{job_id}/artifacts/{name}"


def show_jobs(session: Session, rows: Sequence[Job]) -> tuple[job_schema.Job, ...]:
    """Return jobs as the API says them; two queries, however many jobs."""
    ids = [row.id for row in rows]
    running_px = task_rows.running_px(session, ids)
    outputs = task_rows.done_outputs(session, ids)
    return tuple(
        _show(row, running_px.get(row.id, 0.0), {output for job_id, output in outputs if job_id == row.id})
        for row in rows
    )


def show_job(session: Session, row: Job) -> job_schema.Job:
    """Return one job as the API says it."""
    return show_jobs(session, [row])[0]


def show_counts(row: Job) -> job_schema.TaskCounts:
    """Return how many tasks of a job stand where."""
    return job_schema.TaskCounts(**{status.value: getattr(row, status.value) for status in TaskStatus})


def progress(row: Job, running_px: float) -> float:
    """Return how much of a job is done, by pixels, 0 to 1."""
    if row.status is JobStatus.DONE:
        return 1.0
    return min(1.0, (row.done_px + running_px) / row.total_px) if row.total_px else 0.0


def eta_s(row: Job, running_px: float) -> float | None:
    """Return the seconds to the end, if something runs and something was measured."""
    if not (row.running and row.done_px and row.wall_s and row.planned_s) or row.status is not JobStatus.RUNNING:
        return None
    remaining_px = max(0.0, row.total_px - row.done_px - running_px)
    return remaining_px * (row.wall_s / row.done_px) / row.running


def show_task(row: Task) -> task_schema.Task:
    """Return a task as the API says it."""
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
        tile=tile_of(row),
        output=row.output,
        artifact=row.artifact,
        weight_px=row.weight_px,
        progress=row.progress,
        attempt_number=row.attempt_number,
        failures=row.failures,
        failed_on=tuple(row.failed_on),
        worker=row.worker,
        error=error,
        dispatched_at=utc_or_none(row.dispatched_s),
        started_at=utc_or_none(row.claimed_s),
        ended_at=utc_or_none(row.ended_s),
        cpu_s=row.cpu_s,
        wall_s=row.wall_s,
        log_url=f"{API}/jobs/{row.job_id}/tasks/{identifier}/log" if row.attempt_number else None,
    )


def spec_of(row: Job) -> JobSpec:
    """Return what a job asked for."""
    return _parsed(json.dumps(row.spec))


def tile_of(row: Task) -> TileIndex | None:
    """Return which tile a task renders."""
    if row.tile_row is None or row.tile_col is None:
        return None
    return TileIndex(row=row.tile_row, col=row.tile_col)


# Checking a long job's frames takes tens of milliseconds, and a page of jobs shows fifty.
@lru_cache(maxsize=2048)
def _parsed(text: str) -> JobSpec:
    return JobSpec.model_validate_json(text)


def _show(row: Job, running_px: float, outputs: set[str]) -> job_schema.Job:
    spec = spec_of(row)
    size = frame_size(spec.rig)
    error = None
    if row.error_code is not None:
        error = job_schema.JobError(code=row.error_code, message=row.error_message or "")
    return job_schema.Job(
        id=row.id,
        title=row.title,
        scene=row.scene,
        status=row.status,
        priority=row.priority,
        owner=row.owner,
        created_at=utc(row.created_s),
        started_at=utc_or_none(row.started_s),
        ended_at=utc_or_none(row.ended_s),
        frames=job_schema.FrameCount(count=row.frames_total, text=spec.frames),
        fps=spec.fps,
        spec=spec,
        notes=tuple(row.notes),
        error=error,
        progress=progress(row, running_px),
        eta_s=eta_s(row, running_px),
        tasks=show_counts(row),
        frames_done=row.frames_done,
        frames_total=row.frames_total,
        cpu_s=row.cpu_s,
        late_events=row.late_events,
        outputs=tuple(
            job_schema.OutputLink(
                name=output.file_name,
                url=artifact_url(row.id, names.output_name(output)),
                ready=output.file_name in outputs,
            )
            for output in spec.outputs
        ),
        size=job_schema.Size(
            rows=size.rows, cols=size.cols, lens_rows=size.lens_rows, lens_cols=size.lens_cols,
            px_per_lens=size.px_per_lens,
        ),
    )  # fmt: skip
