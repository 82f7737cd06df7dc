"""The events of the server-sent event stream: the name of each event and the schema of its data."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Literal

from pydantic import Field, RootModel

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.states import FrameStatus, TaskStatus
from service.schemas.answer import Answer
from service.schemas.job import Job, TaskCounts


class EventTopic(StrEnum):
    """The name of an event."""

    JOB = "job"
    TASK = "task"
    FRAME = "frame"
    PROGRESS = "progress"
    RESET = "reset"


class JobRemoved(Answer):
    """The data of a `job` event when the job was removed."""

    id: str
    """The id of the job."""
    removed: Literal[True]


class JobProgress(Answer):
    """The data of a `progress` event: the fields of a job that change while it runs."""

    id: str
    """The id of the job."""
    progress: float
    """The finished part of the job, weighted by pixels, 0 to 1."""
    eta_s: float | None
    """The estimated time left in seconds; null while nothing runs or nothing was measured."""
    tasks: TaskCounts
    frames_done: int
    cpu_s: float
    """CPU seconds of all done tasks."""
    cache_hits: int = 0
    """The number of tiles that came from the render cache and were not rendered."""


class TaskChange(Answer):
    """The data of a `task` event: a task with a new status."""

    job: str
    """The id of the job."""
    id: str
    """The id of the task."""
    kind: TaskKind
    status: TaskStatus
    frame: int | None
    tile: TileIndex | None
    worker: str | None
    attempt_number: int


class FrameChange(Answer):
    """The data of a `frame` event: a frame with a new status."""

    job: str
    """The id of the job."""
    frame: int
    status: FrameStatus


class Reset(Answer):
    """The data of a `reset` event: events between the last one and this one are no longer stored."""

    reason: str
    """The advice for the client: it reads anew what it shows."""


class JobEvent(Answer):
    """A job was submitted, changed or removed."""

    event: Literal[EventTopic.JOB] = EventTopic.JOB
    data: Job | JobRemoved


class ProgressEvent(Answer):
    """A job made progress."""

    event: Literal[EventTopic.PROGRESS] = EventTopic.PROGRESS
    data: JobProgress


class TaskEvent(Answer):
    """A task changed its status."""

    event: Literal[EventTopic.TASK] = EventTopic.TASK
    data: TaskChange


class FrameEvent(Answer):
    """A frame changed its status."""

    event: Literal[EventTopic.FRAME] = EventTopic.FRAME
    data: FrameChange


class ResetEvent(Answer):
    """The client has missed events that are no longer stored, so it reads anew what it shows."""

    event: Literal[EventTopic.RESET] = EventTopic.RESET
    data: Reset


StreamEvent = JobEvent | ProgressEvent | TaskEvent | FrameEvent | ResetEvent


class StreamMessage(RootModel[Annotated[StreamEvent, Field(discriminator="event")]]):
    """One server-sent event: `event` is its name, `data` the JSON of its data field."""
