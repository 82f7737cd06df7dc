"""Publish changes to subscribers: each event is stored in the transaction that makes the change."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import FrameStatus, TaskStatus, frame_status
from service.db import events as event_rows
from service.db import tasks as task_rows
from service.db.tables import Job, Task
from service.events.payloads import job_data, progress_data, task_data
from service.schemas.events import FrameChange, FrameEvent, JobEvent, JobRemoved, ProgressEvent, StreamEvent, TaskEvent
from service.schemas.job import Job as JobSchema


def job_snapshot(session: Session, row: Job) -> JobSchema:
    """Return a job as it is now."""
    running_px = task_rows.running_px(session, [row.id]).get(row.id, 0.0)
    done_outputs = {output for _, output in task_rows.done_outputs(session, [row.id])}
    return job_data(row, running_px=running_px, done_outputs=done_outputs)


def publish_job(session: Session, row: Job) -> None:
    """Publish a job whose status or priority changed."""
    _publish(session, row.id, JobEvent(data=job_snapshot(session, row)))


def publish_removal(session: Session, job_id: str) -> None:
    """Publish that a job was removed."""
    _publish(session, job_id, JobEvent(data=JobRemoved(id=job_id, removed=True)))


def publish_progress(session: Session, row: Job) -> None:
    """Publish the progress of a job."""
    running_px = task_rows.running_px(session, [row.id]).get(row.id, 0.0)
    _publish(session, row.id, ProgressEvent(data=progress_data(row, running_px=running_px)))


def publish_task(session: Session, row: Task) -> None:
    """Publish the new status of a task, and that of its frame if it changed too."""
    _publish(session, row.job_id, TaskEvent(data=task_data(row)))
    status = _frame_status(session, row)
    if status is not None and row.frame is not None:
        publish_frame(session, row.job_id, row.frame, status)


def publish_frame(session: Session, job_id: str, frame: int, status: FrameStatus) -> None:
    """Publish the new status of a frame."""
    _publish(session, job_id, FrameEvent(data=FrameChange(job=job_id, frame=frame, status=status)))


def _publish(session: Session, job_id: str, event: StreamEvent) -> None:
    event_rows.append(session, job_id, event.event, event.data.model_dump(mode="json"))


def _frame_status(session: Session, row: Task) -> FrameStatus | None:
    """Return the status of a task's frame if the task may have changed it."""
    if row.frame is None:
        return None
    if row.status is TaskStatus.FAILED:
        return FrameStatus.FAILED
    if row.status is TaskStatus.DONE and row.kind is TaskKind.ASSEMBLE:
        return FrameStatus.DONE
    if row.status is TaskStatus.RUNNING and row.kind is TaskKind.RENDER:
        return FrameStatus.RENDERING
    if row.kind is TaskKind.RENDER and row.status in (TaskStatus.READY, TaskStatus.CANCELLED):
        # The attempt lost the task. Whether the frame still counts as begun depends on its other tiles.
        tasks = {(kind, status) for _, kind, status, _ in task_rows.frames(session, row.job_id, [row.frame])}
        return frame_status(tasks, session.get_one(Job, row.job_id).status)
    return None
