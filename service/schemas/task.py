"""A task of a job."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.states import TaskStatus
from service.schemas.answer import Answer
from service.schemas.wait import Wait


class TaskError(Answer):
    """The reason why the last failed attempt failed."""

    code: str
    message: str
    permanent: bool
    """True if every other attempt would fail the same way."""


class Task(Answer):
    """A task of a job."""

    id: str
    sequence: int
    """The number of the task within the job."""
    kind: TaskKind
    status: TaskStatus
    stage: str
    """The stage to which the task belongs."""
    needs: str | None
    """The stage that must be done before this task."""
    frame: int | None
    tile: TileIndex | None
    output: str | None
    """The file name of the output that the task encodes."""
    artifact: str
    """The name of the artifact that the task makes."""
    weight_px: int
    """The weight of the task in the progress of the job, in pixels."""
    wait: Wait | None = None
    """Why the task waits; null for a task that runs or has ended, and for every task of a job that has ended."""
    progress: float | None
    """The finished part of the running attempt, 0 to 1."""
    attempt_number: int
    """The number of attempts so far."""
    failures: int
    """The number of failed attempts, without those that were lost."""
    losses: int = 0
    """The number of attempts that were lost with their workers."""
    failed_on: tuple[str, ...]
    """The workers on which attempts failed."""
    worker: str | None
    """The worker of the latest attempt."""
    error: TaskError | None
    dispatched_at: datetime | None
    started_at: datetime | None
    ended_at: datetime | None
    cpu_s: float | None
    wall_s: float | None
    cached: bool = False
    """True if the tile came from the render cache and was not rendered."""
    log_url: str | None
    """The path of the log of the latest attempt."""


class TaskPage(Answer):
    """A page of tasks, in order."""

    items: tuple[Task, ...]
    next_cursor: str | None
    """The cursor of the next page; null on the last page."""


class AttemptOutcome(StrEnum):
    """The outcome of an attempt."""

    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    LOST = "lost"
    """Its process died, or nothing was heard of it any more."""
    STOPPED = "stopped"
    """Somebody stopped it, or its worker ended; also of an attempt whose end is not known."""


class Attempt(Answer):
    """An attempt of a task."""

    task: str
    """The id of the task."""
    kind: TaskKind
    frame: int | None
    tile: TileIndex | None
    output: str | None
    number: int
    """The number of the attempt, 1 for the first one of its task."""
    status: TaskStatus
    """The status of the task now."""
    outcome: AttemptOutcome
    error_code: str | None
    """The code of the error that ended the attempt; null if there was none."""
    worker: str | None
    started_at: datetime
    ended_at: datetime | None
    """When the attempt ended; null while it runs, and where the time is not known."""


class AttemptList(Answer):
    """The attempts of the tasks of a job, the one that began last first.

    Of the attempts that did not do their task, the last 20 of each task are stored.
    """

    items: tuple[Attempt, ...]
    total: int
    """The number of attempts that are stored; `items` has the first of them."""
