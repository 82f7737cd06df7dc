"""The data of events, built from rows."""

from __future__ import annotations

from collections.abc import Collection
from urllib.parse import urlsplit

from lippmann.job.states import JobStatus, PausedBy, TaskStatus, actions_for
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import frame_size
from service.db.tables import Job
from service.db.task_state import TaskState
from service.ids import task_id
from service.schemas import job as schema
from service.schemas.answer import utc, utc_or_none
from service.schemas.events import JobProgress, TaskChange
from service.schemas.links import archive_url, artifact_url
from service.schemas.wait import Wait


def job_data(
    row: Job,
    *,
    running_px: float,
    done_outputs: Collection[str],
    skipped_frames: tuple[int, ...],
    wait: Wait | None = None,
    newest_frame: int | None = None,
) -> schema.Job:
    """Return a whole job.

    Parameters
    ----------
    running_px
        The pixels that running attempts have finished.
    done_outputs
        The file names of the outputs that are done.
    skipped_frames
        The frames that a user left out.
    wait
        Why no task of the job runs. Events have none, since it depends on the whole farm.
    newest_frame
        The frame whose thumbnail is the picture of the job. Events have none, since each of them would search for it.
    """
    spec = row.parsed_spec
    size = frame_size(spec.rig)
    error = None
    if row.error_code is not None:
        error = schema.JobError(code=row.error_code, message=row.error_message or "")
    return schema.Job(
        id=row.id,
        title=row.title,
        scene=row.scene,
        status=row.status,
        actions=actions_for(row.status, row.paused_by, skipped=row.skipped),
        priority=row.priority,
        owner=row.owner,
        owner_id=row.owner_id,
        shared=row.shared,
        created_at=utc(row.created_s),
        started_at=utc_or_none(row.started_s),
        ended_at=utc_or_none(row.ended_s),
        frames=schema.FrameCount(count=row.frames_total, text=spec.frames),
        fps=spec.fps,
        spec=spec,
        notes=tuple(row.notes),
        error=error,
        webhook=_webhook(row),
        pause=_pause(row),
        wait=wait,
        progress=progress(row, running_px),
        eta_s=eta_s(row, running_px),
        tasks=task_counts(row),
        frames_done=row.frames_done,
        frames_total=row.frames_total,
        skipped_frames=skipped_frames,
        cpu_s=row.cpu_s,
        cache_hits=row.cache_hits,
        late_events=row.late_events,
        outputs=tuple(
            schema.OutputLink(
                name=output.file_name,
                url=artifact_url(row.id, names.output_name(output)),
                archive_url=archive_url(row.id, output.file_name),
                ready=output.file_name in done_outputs,
            )
            for output in spec.outputs
        ),
        size=schema.Size(
            rows=size.rows, cols=size.cols, lens_rows=size.lens_rows, lens_cols=size.lens_cols,
            px_per_lens=size.px_per_lens,
        ),
        poster=None if newest_frame is None else artifact_url(row.id, names.thumb_name(newest_frame)),
        artifact_bytes=row.artifact_bytes,
    )  # fmt: skip


def _pause(row: Job) -> schema.JobPause | None:
    if row.status is not JobStatus.PAUSED:
        return None
    by = row.paused_by or PausedBy.USER  # paused by an earlier release, in which only users did
    since_at = utc_or_none(row.paused_s)
    return schema.JobPause(by=by, code=row.pause_code, reason=row.pause_reason, since_at=since_at)


def _webhook(row: Job) -> schema.JobWebhook | None:
    if row.webhook_url is None:
        return None
    return schema.JobWebhook(host=urlsplit(row.webhook_url).netloc, error=row.webhook_error)


def progress_data(row: Job, *, running_px: float) -> JobProgress:
    """Return the fields of a job that change while it runs."""
    return JobProgress(
        id=row.id,
        progress=progress(row, running_px),
        eta_s=eta_s(row, running_px),
        tasks=task_counts(row),
        frames_done=row.frames_done,
        cpu_s=row.cpu_s,
        cache_hits=row.cache_hits,
    )


def task_data(task: TaskState) -> TaskChange:
    """Return the fields of a task that change with its status."""
    return TaskChange(
        job=task.job_id,
        id=task_id(task.job_id, task.sequence),
        kind=task.kind,
        status=task.status,
        frame=task.frame,
        tile=task.tile,
        worker=task.worker,
        attempt_number=task.attempt_number,
    )


def task_counts(row: Job) -> schema.TaskCounts:
    """Return the number of tasks of a job in each status."""
    return schema.TaskCounts(**{status.value: getattr(row, status.value) for status in TaskStatus})


def progress(row: Job, running_px: float) -> float:
    """Return the finished part of a job, weighted by pixels, 0 to 1."""
    if row.status is JobStatus.DONE:
        return 1.0
    return min(1.0, (row.done_px + running_px) / row.total_px) if row.total_px else 0.0


def eta_s(row: Job, running_px: float) -> float | None:
    """Estimate the seconds that a job still takes.

    The estimate is the remaining pixels times the measured seconds per pixel, divided by the number of running tasks.
    Pixels from the render cache measure nothing. There is no estimate (None) while nothing runs or nothing is measured.
    """
    measured_px = row.done_px - row.cached_px
    if not (row.running and measured_px and row.wall_s and row.planned_s) or row.status is not JobStatus.RUNNING:
        return None
    remaining_px = max(0.0, row.total_px - row.done_px - running_px)
    return remaining_px * (row.wall_s / measured_px) / row.running
