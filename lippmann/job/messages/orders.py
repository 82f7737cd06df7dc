"""Orders, which the service sends to workers. They carry ids, numbers and names; pixels travel as artifacts."""

from __future__ import annotations

from enum import StrEnum

from pydantic import BaseModel, ConfigDict, Field

from lippmann.digest import Digest
from lippmann.job.rendering.workers import without_engine

MOST_THREADS = 16
"""The largest number of threads of one task. More of them need more memory and processes than a task may have."""


class TaskKind(StrEnum):
    """The kind of a task."""

    PROBE = "probe"
    RENDER = "render"
    ASSEMBLE = "assemble"
    ENCODE = "encode"


def requirement_of(requirement: str, kind: TaskKind) -> str:
    """Return the requirement of a task on its worker, where that of its job is given; both as `JobRequirement.text`.

    >>> requirement_of('{"engine":"mitsuba"}', TaskKind.ASSEMBLE)
    '{"engine":"none"}'
    >>> requirement_of('{"engine":"mitsuba"}', TaskKind.RENDER)
    '{"engine":"mitsuba"}'
    """
    return requirement if kind in (TaskKind.PROBE, TaskKind.RENDER) else without_engine(requirement)


class TileIndex(BaseModel):
    """The row and column of a tile in its frame, counted from 0 at the top left."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    row: int
    col: int


class Order(BaseModel):
    """The order of one attempt of one task.

    `attempt` is the fence: every event of the work carries it, and only the attempt that owns the task may change the
    task. The workers in `avoid` decline the order. A worker ignores the fields that a newer service adds, because a
    farm is upgraded one host after the other.
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
    skipped_frames: tuple[int, ...] = ()
    """The frames of the job that an output leaves out."""
    digests: dict[str, Digest] = Field(default_factory=dict)
    """The expected digests of the artifacts that the task reads, by their names below the job; an artifact without one
    is read without a check."""
    threads: int = 1
    """The number of threads that the task may use: with more than one, slots of the worker would idle otherwise. It is
    limited by the worker's own slots, and by `MOST_THREADS`."""
    requirement: str = ""
    """The requirement of the task on its worker, as `JobRequirement.text`; it has a queue of its own."""
    store_id: str | None = None
    """The id of the farm's artifact store. A worker whose store has another id or none, for example because its disk is
    not mounted, neither publishes there nor takes anything to be missing."""
    trace: str | None = None
    """The context of the order for traces of OpenTelemetry, as a `traceparent`; None if none are made."""
