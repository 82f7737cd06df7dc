"""A job, its outputs and its size."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum
from typing import Annotated, Self

from pydantic import Field, model_validator

from lippmann.job.animation.frames import MAX_FRAME_NUMBER
from lippmann.job.spec import JobSpec
from lippmann.job.states import JobAction, JobStatus, PausedBy
from service.schemas.answer import Answer, RequestBody
from service.schemas.wait import Wait


class FrameCount(Answer):
    """The frames of a job."""

    count: int
    text: str
    """The frames as the job file gives them, such as `1-48:2, 60`."""


class JobError(Answer):
    """The reason why a job failed."""

    code: str
    message: str


class JobPause(Answer):
    """Who paused a job, and why."""

    by: PausedBy
    """`farm` if a full disk or another fault prevents the work; then the job goes on by itself."""
    code: str | None
    """The code of the cause, such as `store-full`; null for a user's pause."""
    reason: str | None
    """The sentence that a user reads; null for a user's pause."""
    since_at: datetime | None


class JobWebhook(Answer):
    """The receiver of the message that is sent when the job has ended."""

    host: str
    """The host and the port; the rest of the URL may hold a secret."""
    error: str | None
    """Why the latest attempt to deliver the message failed; null if none failed."""


class TaskCounts(Answer):
    """The number of tasks in each status."""

    waiting: int
    ready: int
    dispatched: int
    running: int
    done: int
    failed: int
    cancelled: int
    skipped: int = 0


class OutputLink(Answer):
    """An output of a job."""

    name: str
    url: str
    """The path of the video, or of the JSON file that lists the files of any other output."""
    archive_url: str = ""
    """The path of a zip with all files of the output, which exists when it is done."""
    ready: bool
    """True if the output is done."""


class Size(Answer):
    """The size of an integral image in pixels and lenses."""

    rows: int
    """Height in pixels."""
    cols: int
    """Width in pixels."""
    lens_rows: int
    lens_cols: int
    px_per_lens: int


class Job(Answer):
    """A job."""

    id: str
    title: str
    scene: str
    status: JobStatus
    actions: tuple[JobAction, ...]
    """The actions that are allowed in the present status."""
    priority: int
    """The priority, 0 to 100. Tasks of jobs with a higher priority run first."""
    owner: str
    """The name of the key that submitted the job."""
    owner_id: str = "admin"
    """The owner of the job, as `GET /session` names the caller: only the owner and admins change the job. Jobs of
    earlier releases belong to `admin`."""
    shared: bool = False
    """True if everybody with a key sees the job, also on a farm that hides jobs from other owners."""
    created_at: datetime
    started_at: datetime | None
    ended_at: datetime | None
    frames: FrameCount
    fps: float
    spec: JobSpec
    """The job file with all defaults."""
    notes: tuple[str, ...]
    """Remarks of the check of the optics."""
    error: JobError | None
    webhook: JobWebhook | None = None
    """The receiver of the message at the end of the job; null for a job that was submitted without a webhook."""
    pause: JobPause | None = None
    """Who paused the job, and why; null for a job that is not paused."""
    wait: Wait | None = None
    """Why no task of the job runs; null while one runs, for a job that has ended, and in events of the stream."""
    progress: float
    """The finished part of the job, weighted by pixels, 0 to 1."""
    eta_s: float | None
    """The estimated time left in seconds, from the measured time per pixel and the number of running tasks; null while
    nothing runs or nothing was measured."""
    tasks: TaskCounts
    frames_done: int
    frames_total: int
    skipped_frames: tuple[int, ...] = ()
    """The frames that a user left out; no output shows them."""
    cpu_s: float
    """CPU seconds of all done tasks."""
    cache_hits: int = 0
    """The number of tiles that came from the render cache and were not rendered."""
    late_events: int
    """The number of events of attempts that no longer owned their task."""
    outputs: tuple[OutputLink, ...]
    size: Size
    """The size of the integral image of a frame."""
    poster: str | None = None
    """The path of the thumbnail of the newest frame; null without a frame, and in events of the stream."""
    artifact_bytes: int = 0
    """The bytes of the artifacts that the tasks of the job have stored."""


class JobSort(StrEnum):
    """The value by which a list of jobs is sorted."""

    CREATED = "created"
    NAME = "name"
    """The title, or the scene of a job without one."""
    OWNER = "owner"
    STATUS = "status"
    """The place of the status in the life of a job."""
    PRIORITY = "priority"
    WORK = "work"
    """The order in which open jobs get slots: the highest priority first, among equals the oldest. Jobs that have ended
    come after them."""
    FRAMES = "frames"
    PROGRESS = "progress"
    TIME_LEFT = "time_left"
    """The estimated time left; jobs without an estimate come last."""
    COST = "cost"
    """The CPU time so far."""


class JobPage(Answer):
    """A page of jobs."""

    items: tuple[Job, ...]
    next_cursor: str | None
    """The cursor of the next page; null on the last page."""
    total: int | None = None
    """The number of jobs on all pages; null unless the request asks for it."""


class FramesToSkip(RequestBody):
    """The frames that a job leaves out."""

    frames: tuple[Annotated[int, Field(ge=1, le=MAX_FRAME_NUMBER)], ...] | None = Field(
        default=None, min_length=1, max_length=100_000
    )
    """The numbers of the frames; null for those with a task that failed."""


class JobChange(RequestBody):
    """A change of a job: of its priority, of who sees it, or of both."""

    priority: int | None = Field(default=None, ge=0, le=100)
    """The new priority. Tasks of jobs with a higher priority run first."""
    shared: bool | None = None
    """True to show the job to everybody with a key, also on a farm that hides jobs from other owners."""

    @model_validator(mode="after")
    def _check_something(self) -> Self:
        if self.priority is None and self.shared is None:
            raise ValueError("expected `priority` or `shared`, got neither")
        return self
