"""What a worker is told: ids, numbers and names; pixels travel by artifact name."""

from __future__ import annotations

from enum import StrEnum

from pydantic import BaseModel, ConfigDict


class TaskKind(StrEnum):
    """What a task does."""

    PROBE = "probe"
    RENDER = "render"
    ASSEMBLE = "assemble"
    ENCODE = "encode"


class TileIndex(BaseModel):
    """Which tile of a frame: counted from the top left, from 0."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    row: int
    col: int


class Order(BaseModel):
    """One attempt of one task, as it travels to a worker.

    `attempt` is the fence: every event about the work carries it, and only the attempt that owns the task may change
    the task. Workers named in `avoid` decline. A worker leaves alone what a newer service says beside: a farm is
    upgraded one host after the other.
    """

    model_config = ConfigDict(frozen=True, extra="ignore")

    kind: TaskKind
    job_id: str
    task_id: str
    attempt: str
    attempt_number: int
    frame: int | None = None
    tile: TileIndex | None = None
    output: str | None = None
    avoid: tuple[str, ...] = ()
