"""What a worker says: events on one Redis stream, and its presence."""

from __future__ import annotations

from enum import StrEnum

from pydantic import BaseModel, ConfigDict, Field


class EventKind(StrEnum):
    """What happened to an attempt."""

    CLAIMED = "claimed"
    BEAT = "beat"
    DONE = "done"
    FAILED = "failed"
    DECLINED = "declined"


class Failure(BaseModel):
    """Why an attempt failed."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    code: str
    message: str
    permanent: bool


LONGEST_PROBE_S = 1e6
"""12 days: a probe is ended long before, and plans are made of what it says."""


class ProbeResult(BaseModel):
    """What the small first frame measured."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    start_s: float = Field(ge=0, le=LONGEST_PROBE_S)
    """Seconds of a POV-Ray run that do not grow with pixels: start and parse."""
    s_per_px: float = Field(ge=0, le=LONGEST_PROBE_S)
    """CPU seconds of one rendered pixel."""
    tileable: bool
    """Whether tiles equal the whole (radiosity differs a tile)."""
    renders: bool = True
    """Whether there is anything to render."""


class Event(BaseModel):
    """One thing that happened to one attempt."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: EventKind
    job_id: str
    task_id: str
    attempt: str
    worker: str
    at_s: float
    """Seconds since 1970, UTC, on the worker's clock: for people; order is the stream's."""
    progress: float | None = Field(default=None, ge=0, le=1)
    cpu_s: float | None = None
    wall_s: float | None = None
    failure: Failure | None = None
    probe: ProbeResult | None = None


class Presence(BaseModel):
    """A worker that is there, said every few seconds and forgotten when it stops saying so."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    host: str
    pid: int
    slots: int
    sandbox: str
    povray: str
    version: str
    started_s: float
    seen_s: float
