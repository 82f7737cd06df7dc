"""Publish changes to subscribers: each event is stored in the transaction that makes the change.

Several changes of a task in one transaction are one event, with the status at its end.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

from sqlalchemy.orm import Session

from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import FrameStatus, TaskStatus, frame_status
from service.db import events as event_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.tables import Job
from service.db.task_state import TaskState
from service.events.payloads import job_data, progress_data, task_data
from service.schemas.events import EventTopic, FrameChange, JobProgress, JobRemoved, TaskChange
from service.schemas.job import Job as JobSchema

_BEGUN = frozenset({TaskStatus.RUNNING, TaskStatus.DONE})
_Data = JobSchema | JobRemoved | JobProgress | TaskChange | FrameChange
_TOPICS: dict[type[_Data], EventTopic] = {
    JobSchema: EventTopic.JOB,
    JobRemoved: EventTopic.JOB,
    JobProgress: EventTopic.PROGRESS,
    TaskChange: EventTopic.TASK,
    FrameChange: EventTopic.FRAME,
}
_TaskChange = tuple[TaskState, TaskState]
"""A task before and after a transaction."""


def job_snapshot(session: Session, row: Job) -> JobSchema:
    """Return a job as it is now."""
    (snapshot,) = _snapshots(session, [row])
    return snapshot


def publish_jobs(session: Session, rows: Sequence[Job]) -> None:
    """Publish jobs whose status or priority changed, or who sees them."""
    _publish(session, [(job.id, job) for job in _snapshots(session, rows)])


def publish_removal(session: Session, job_id: str) -> None:
    """Publish that a job was removed."""
    _publish(session, [(job_id, JobRemoved(id=job_id, removed=True))])


def publish_progress(session: Session, rows: Sequence[Job]) -> None:
    """Publish the progress of jobs, one event each."""
    running_px = task_rows.running_px(session, [row.id for row in rows])
    _publish(session, [(row.id, progress_data(row, running_px=running_px.get(row.id, 0.0))) for row in rows])


def publish_tasks(session: Session, changes: Iterable[_TaskChange]) -> None:
    """Publish the new statuses of tasks, and those of their frames that changed too."""
    moved = [(before, after) for before, after in changes if before.status is not after.status]
    tasks: list[tuple[str, _Data]] = [(after.job_id, task_data(after)) for _, after in moved]
    _publish(session, tasks + _frame_events(_frames(session, moved)))


def publish_frames(session: Session, job_id: str, frames: Iterable[int]) -> None:
    """Publish the statuses that frames have by their tasks now."""
    wanted = sorted(frames)
    _publish(session, _frame_events(_queried(session, job_id, wanted)) if wanted else ())


def _snapshots(session: Session, rows: Sequence[Job]) -> list[JobSchema]:
    job_ids = [row.id for row in rows]
    running_px, done = task_rows.running_px(session, job_ids), task_rows.done_outputs(session, job_ids)
    outputs: dict[str, set[str]] = defaultdict(set)
    for job_id, output in done:
        outputs[job_id].add(output)
    skipped = task_rows.skipped_frames(session, [row.id for row in rows if row.skipped])
    return [
        job_data(
            row,
            running_px=running_px.get(row.id, 0.0),
            done_outputs=outputs[row.id],
            skipped_frames=skipped.get(row.id, ()),
        )
        for row in rows
    ]


def _publish(session: Session, events: Iterable[tuple[str, _Data]]) -> None:
    event_rows.append(session, [(job_id, _TOPICS[type(data)], data.model_dump(mode="json")) for job_id, data in events])


def _frame_events(frames: dict[tuple[str, int], FrameStatus]) -> list[tuple[str, _Data]]:
    return [(job_id, FrameChange(job=job_id, frame=frame, status=status)) for (job_id, frame), status in frames.items()]


def _frames(session: Session, moved: Sequence[_TaskChange]) -> dict[tuple[str, int], FrameStatus]:
    """Return the statuses of the frames that changed with their tasks."""
    found: dict[tuple[str, int], FrameStatus] = {}
    doubtful: dict[str, set[int]] = defaultdict(set)
    for before, after in moved:
        if after.frame is None:
            continue
        status = _frame_status(before, after)
        if status is not None and found.get((after.job_id, after.frame)) is not FrameStatus.FAILED:
            found[after.job_id, after.frame] = status
        if after.kind is TaskKind.RENDER and before.status in _BEGUN and after.status not in _BEGUN:
            doubtful[after.job_id].add(after.frame)
    for job_id, frames in doubtful.items():
        found |= _queried(session, job_id, sorted(frames))
    return found


def _frame_status(before: TaskState, after: TaskState) -> FrameStatus | None:
    """Return the status of a task's frame as far as the task alone decides it."""
    if after.status is TaskStatus.FAILED:
        return FrameStatus.FAILED
    if after.status is TaskStatus.DONE and after.kind is TaskKind.ASSEMBLE:
        return FrameStatus.DONE
    if after.kind is TaskKind.RENDER and after.status in _BEGUN and before.status not in _BEGUN:
        return FrameStatus.RENDERING
    return None


def _queried(session: Session, job_id: str, frames: Sequence[int]) -> dict[tuple[str, int], FrameStatus]:
    """Return the statuses of frames that lost an attempt: they depend on the other tiles, and on the job."""
    ((_, job),) = job_rows.statuses(session, [job_id])
    tasks: dict[int, set[tuple[TaskKind, TaskStatus]]] = defaultdict(set)
    for frame, kind, status, _ in task_rows.frames(session, job_id, frames):
        if frame is not None:
            tasks[frame].add((kind, status))
    return {(job_id, frame): frame_status(tasks[frame], job) for frame in frames}
