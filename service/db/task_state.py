"""The state of a task as plain values, for rules that work without a database."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.states import TaskStatus

TaskKey = tuple[str, int]
"""The job and the sequence number of a task."""


class TaskState(NamedTuple):
    """The columns of a task that rules, orders and events read. Each field has the name of its column.

    There is one for each change of each task, and a tuple is changed several times faster than a frozen dataclass.
    """

    job_id: str
    sequence: int
    kind: TaskKind
    stage: str
    frame: int | None
    tile_row: int | None
    tile_col: int | None
    output: str | None
    artifact: str
    weight_px: int
    status: TaskStatus
    attempt: str | None
    attempt_number: int
    failures: int
    losses: int
    failed_on: list[str]
    deferrals: int
    worker: str | None
    instance: str | None
    progress: float | None
    error_code: str | None
    stored_bytes: int = 0

    @property
    def key(self) -> TaskKey:
        """The job and the sequence number of the task."""
        return self.job_id, self.sequence

    @property
    def tile(self) -> TileIndex | None:
        """The tile that the task renders; None for a task that renders none."""
        if self.tile_row is None or self.tile_col is None:
            return None
        return TileIndex(row=self.tile_row, col=self.tile_col)


@dataclass(frozen=True, slots=True)
class HeldAttempt:
    """An attempt that owns a task, with what is known of its progress. Each field has the name of its column."""

    job_id: str
    sequence: int
    kind: TaskKind
    status: TaskStatus
    attempt: str
    worker: str | None
    instance: str | None
    artifact: str
    dispatched_s: float | None
    dispatched_idle_s: float | None
    heartbeat_s: float | None
