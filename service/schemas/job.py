"""A job, its outputs and size."""

from __future__ import annotations

from datetime import datetime

from pydantic import Field

from lippmann.job.spec import JobSpec
from lippmann.job.states import JobStatus
from service.schemas.answer import Answer


class FrameCount(Answer):
    """Which frames were asked for."""

    count: int
    text: str
    """As in `1-48:2, 60`."""


class JobError(Answer):
    """Why a job failed."""

    code: str
    message: str


class TaskCounts(Answer):
    """How many tasks stand where."""

    waiting: int
    ready: int
    dispatched: int
    running: int
    done: int
    failed: int
    cancelled: int


class OutputLink(Answer):
    """An output that was asked for: a video, or what tells of the files of any other kind."""

    name: str
    url: str
    ready: bool


class Size(Answer):
    """An integral image in pixels and lenses."""

    rows: int
    cols: int
    lens_rows: int
    lens_cols: int
    px_per_lens: int


class Job(Answer):
    """A job."""

    id: str
    title: str
    scene: str
    status: JobStatus
    priority: int
    owner: str
    """The name of the key that submitted it."""
    created_at: datetime
    started_at: datetime | None
    ended_at: datetime | None
    frames: FrameCount
    fps: float
    spec: JobSpec
    notes: tuple[str, ...]
    """What the check of the optics found worth saying."""
    error: JobError | None
    progress: float
    """Weighted by pixels, 0 to 1."""
    eta_s: float | None
    """From the measured seconds a pixel and the attempts that run; null when nothing runs or nothing was measured."""
    tasks: TaskCounts
    frames_done: int
    frames_total: int
    cpu_s: float
    """CPU seconds of everything that is done."""
    late_events: int
    """Events of attempts that no longer owned their task."""
    outputs: tuple[OutputLink, ...]
    size: Size


class JobPage(Answer):
    """Jobs, newest first."""

    items: tuple[Job, ...]
    next_cursor: str | None


class JobChange(Answer):
    """What may be changed about a job."""

    priority: int = Field(ge=0, le=100)
