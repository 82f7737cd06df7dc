"""Jobs, tasks, logs and scenes as text."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from lippmann.terminal.progress import duration_text, time_text
from lippmann.terminal.table import fields, table

if TYPE_CHECKING:
    from lippmann.client.logs import TaskLog
    from service.schemas.job import Job
    from service.schemas.scene import Scene
    from service.schemas.task import Task
    from service.schemas.wait import Wait


def job_table(jobs: Iterable[Job]) -> str:
    """Return jobs, one a line."""
    rows = [
        (
            job.id,
            job.status,
            f"{job.progress:.0%}",
            f"{job.frames_done}/{job.frames_total}",
            job.wait.code if job.wait is not None else "",
            job.scene,
            job.title,
        )
        for job in jobs
    ]
    return table(("id", "status", "done", "frames", "waits", "scene", "title"), rows) if rows else "No jobs."


def task_table(tasks: Iterable[Task]) -> str:
    """Return tasks, one a line, with the reason why each of them waits."""
    rows = [(task.id, task.kind, _subject(task), task.status, task.attempt_number, _reason(task)) for task in tasks]
    return table(("id", "kind", "of", "status", "attempts", "waits"), rows) if rows else "No tasks."


def job_text(job: Job) -> str:
    """Return everything about one job that fits on a screen."""
    size = job.size
    going = {name: count for name, count in job.tasks.model_dump().items() if count}
    lines = fields(
        [
            ("id", job.id),
            ("title", job.title),
            ("scene", job.scene),
            ("status", job.status),
            ("paused", _pause_text(job)),
            ("waits", wait_text(job.wait) if job.wait is not None and job.pause is None else None),
            ("error", f"{job.error.message} ({job.error.code})" if job.error else None),
            ("frames", f"{job.frames_done} of {job.frames_total} ({job.frames.text}), {job.fps:g} a second"),
            ("skipped", f"frames {', '.join(map(str, job.skipped_frames))}" if job.skipped_frames else None),
            ("size", f"{size.lens_cols} x {size.lens_rows} lenses, {size.cols} x {size.rows} px"),
            ("done", f"{job.progress:.0%}"),
            ("to go", duration_text(job.eta_s) if job.eta_s is not None else None),
            ("tasks", ", ".join(f"{count} {name}" for name, count in going.items())),
            ("cache hits", job.cache_hits or None),
            ("CPU", duration_text(job.cpu_s) if job.cpu_s else None),
            ("priority", job.priority),
            ("by", job.owner),
            ("webhook", _webhook_text(job)),
            ("created", time_text(job.created_at)),
            ("ended", time_text(job.ended_at) if job.ended_at else None),
            ("outputs", ", ".join(output.name + ("" if output.ready else " (not yet)") for output in job.outputs)),
        ]
    )
    return "\n".join([lines, *(f"note: {note}" for note in job.notes)])


def wait_text(wait: Wait) -> str:
    """Return why something waits, with the ids that its sentence only counts.

    >>> from service.schemas.wait import Wait, WaitCode
    >>> wait_text(Wait(code=WaitCode.SLOTS_BUSY, message="It is the next one.", jobs=("j1", "j2")))
    'It is the next one. (j1, j2)'
    """
    ids = ", ".join((*wait.jobs, *wait.tasks))
    return f"{wait.message} ({ids})" if ids else wait.message


def log_text(log: TaskLog) -> str:
    """Return the log of a task under a head that names the task."""
    of = " ".join(filter(None, (log.kind, _subject(log))))
    return f"==> {of}, attempt {log.attempt}, {log.status} ({log.task})\n{log.log.rstrip()}\n"


def log_data(log: TaskLog) -> dict[str, Any]:
    """Return the log of a task as data."""
    tile = None if log.tile is None else log.tile.model_dump(mode="json")
    return asdict(replace(log, tile=None)) | {"tile": tile}


def _subject(task: Task | TaskLog) -> str:
    """Return what a task is about: a frame, a tile of it, or an output."""
    if task.output is not None:
        return task.output
    frame = "" if task.frame is None else f"frame {task.frame}"
    return frame if task.tile is None else f"{frame}, tile {task.tile.row},{task.tile.col}"


def _reason(task: Task) -> str:
    """Return why a task waits, or why its last attempt failed."""
    if task.wait is not None:
        return wait_text(task.wait)
    return f"{task.error.message} ({task.error.code})" if task.error is not None else ""


def _webhook_text(job: Job) -> str | None:
    if job.webhook is None:
        return None
    return job.webhook.host + (f": {job.webhook.error}" if job.webhook.error else "")


def _pause_text(job: Job) -> str | None:
    if job.pause is None:
        return None
    return f"by the {job.pause.by}" + (f": {job.pause.reason}" if job.pause.reason else "")


def scene_table(scenes: Iterable[Scene]) -> str:
    """Return scenes, one a line."""
    rows = [(scene.name, "built in" if scene.builtin else "uploaded", scene.title) for scene in scenes]
    return table(("name", "from", "title"), rows) if rows else "No scenes."


def scene_text(scene: Scene) -> str:
    """Return a scene with its parameters."""
    rows = [
        (name, one.type, one.default, _bounds(one.minimum, one.maximum), one.unit, one.description)
        for name, one in scene.parameters.items()
    ]
    stage, sheets = scene.stage, scene.sheets
    shows = ("stage", f"reference at {stage.reference_mm:g} mm, sharp from {stage.near_mm:g} to {stage.far_mm:g} mm")
    if sheets is not None:
        cols_rows = " x ".join(map(str, reversed(sheets.count or ())))
        shows = ("sheets", f"{len(sheets.files)} frames of {cols_rows} lenses, {sheets.pitch_px:g} px each")
    head = fields(
        [
            ("name", scene.name),
            ("title", scene.title),
            ("description", scene.description),
            ("license", scene.license),
            shows,
            ("digest", scene.digest),
        ]
    )
    parameters = table(("parameter", "type", "default", "range", "unit", "what it does"), rows) if rows else ""
    return f"{head}\n\n{parameters}".rstrip()


def _bounds(minimum: float | None, maximum: float | None) -> str:
    if minimum is None and maximum is None:
        return ""
    return f"{'' if minimum is None else f'{minimum:g}'}..{'' if maximum is None else f'{maximum:g}'}"
