"""Tells listeners what changed, in the transaction that changes it."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.api import presenters as show
from service.api.frame_status import frame_status
from service.db import events as event_rows
from service.db import tasks as task_rows
from service.db.tables import EventTopic, Job, Task
from service.ids import task_id
from service.schemas.frame import FrameStatus


def tell_job(session: Session, row: Job) -> None:
    """Say that a job's status or settings changed."""
    data = show.show_job(session, row).model_dump(mode="json")
    event_rows.announce(session, row.id, EventTopic.JOB, data)


def tell_progress(session: Session, row: Job) -> None:
    """Say how far a job is."""
    running_px = task_rows.running_px(session, [row.id]).get(row.id, 0.0)
    data = {
        "id": row.id,
        "progress": show.progress(row, running_px),
        "eta_s": show.eta_s(row, running_px),
        "tasks": show.show_counts(row).model_dump(),
        "frames_done": row.frames_done,
        "cpu_s": row.cpu_s,
    }
    event_rows.announce(session, row.id, EventTopic.PROGRESS, data)


def tell_task(session: Session, row: Task) -> None:
    """Say that a task moved, and what that means for its frame."""
    tile = show.tile_of(row)
    data = {
        "job": row.job_id,
        "id": task_id(row.job_id, row.sequence),
        "kind": row.kind.value,
        "status": row.status.value,
        "frame": row.frame,
        "tile": tile.model_dump() if tile else None,
        "worker": row.worker,
        "attempt_number": row.attempt_number,
    }
    event_rows.announce(session, row.job_id, EventTopic.TASK, data)
    status = _frame_status(session, row)
    if status is not None:
        frame = {"job": row.job_id, "frame": row.frame, "status": status.value}
        event_rows.announce(session, row.job_id, EventTopic.FRAME, frame)


def _frame_status(session: Session, row: Task) -> FrameStatus | None:
    """Return where a task's frame stands now, if that is new by its move."""
    if row.frame is None:
        return None
    if row.status is TaskStatus.FAILED:
        return FrameStatus.FAILED
    if row.status is TaskStatus.DONE and row.kind is TaskKind.ASSEMBLE:
        return FrameStatus.DONE
    if row.status is TaskStatus.RUNNING and row.kind is TaskKind.RENDER:
        return FrameStatus.RENDERING
    if row.kind is TaskKind.RENDER and row.status in (TaskStatus.READY, TaskStatus.CANCELLED):
        # Taken from its attempt: whether the frame has begun depends on its other tiles.
        standing = task_rows.frames(session, row.job_id, [row.frame])
        job = session.get_one(Job, row.job_id)
        return frame_status({(kind, status) for _, kind, status, _ in standing}, job.status)
    return None
