"""A task of a job."""

from __future__ import annotations

from datetime import datetime

from lippmann.job.orders import TaskKind, TileIndex
from lippmann.job.states import TaskStatus
from service.schemas.answer import Answer


class TaskError(Answer):
    """Why the last attempt that failed did so."""

    code: str
    message: str
    permanent: bool


class Task(Answer):
    """A task."""

    id: str
    sequence: int
    kind: TaskKind
    status: TaskStatus
    stage: str
    needs: str | None
    frame: int | None
    tile: TileIndex | None
    output: str | None
    artifact: str
    weight_px: int
    progress: float | None
    attempt_number: int
    failures: int
    failed_on: tuple[str, ...]
    worker: str | None
    error: TaskError | None
    dispatched_at: datetime | None
    started_at: datetime | None
    ended_at: datetime | None
    cpu_s: float | None
    wall_s: float | None
    log_url: str | None


class TaskPage(Answer):
    """Tasks in order."""

    items: tuple[Task, ...]
    next_cursor: str | None
