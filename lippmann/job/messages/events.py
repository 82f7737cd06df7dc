"""The reports of workers over Redis: events on one stream, the presence of a worker, and the lease of an attempt.

The stop signal of an attempt travels in the other direction and has its place here, beside the lease.

A farm is upgraded one host after the other. The fields that a newer worker adds are ignored, and a field that an older
worker does not send has a meaning.
"""

from __future__ import annotations

import re
from enum import StrEnum
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from lippmann.digest import Digest
from lippmann.job.animation.frames import MAX_FRAME_NUMBER
from lippmann.job.messages.protocol import OLDEST_PROTOCOL, PROTOCOL, understand_each_other
from lippmann.job.rendering.workers import JobRequirement
from lippmann.job.scenes.scene_camera import SceneCamera

MAX_EVENT_BYTES = 32_000_000
"""The limit of an event; the digests of a data set of 100,000 files have 20 MB."""
MAX_MESSAGE_VALUES = 500_000
"""The limit of the values in a message, counted by its commas; the digests of 100,000 files are 200,000."""
MAX_MESSAGE = 20_000
"""The length at which the text of a message is cut."""
MAX_PRESENCE_BYTES = 1_000_000
"""The limit of a presence, which names every attempt that the worker holds."""
MAX_LEASE_BYTES = 4096
"""The limit of a lease and of a stop signal."""
MAX_SLOTS = 100_000
"""The greatest number of slots of a worker that is believed; workers have at most 1,024."""
MAX_LOAD = 1e6
"""The greatest load average of a machine that is believed."""
PROTOCOL_OF_OLD_WORKERS = 1
"""The version of the messages of a worker that does not say it."""
LONGEST_S = 1e9
"""The bound of measured times, 30 years, which keeps sums finite."""

_NOT_STORABLE = re.compile("[\0\ud800-\udfff]")


def _storable(text: str) -> str:
    return _NOT_STORABLE.sub("\N{REPLACEMENT CHARACTER}", text[:MAX_MESSAGE])


Text = Annotated[str, AfterValidator(_storable)]
"""A text for people. It is cut, and what PostgreSQL does not store is replaced: NUL and halves of surrogate pairs."""
Name = Annotated[str, Field(max_length=500, pattern=r"^[^\x00]*$")]
"""An id or a name."""
Seconds = Annotated[float, Field(ge=0, le=LONGEST_S)]
_SHA256 = re.compile(r"[0-9a-f]{64}")


def _check_digest(digest: Digest) -> Digest:
    if not (0 <= digest.size < 2**63 and _SHA256.fullmatch(digest.sha256)):
        raise ValueError("a size and a SHA-256")
    return digest


Digests = dict[Name, Annotated[Digest, AfterValidator(_check_digest)]]

WorkerName = Annotated[str, Field(min_length=1, max_length=100, pattern=r"^[^\x00-\x1f\x7f]+$")]
"""The name of a worker: 1 to 100 characters, none of them a control character."""


class EventKind(StrEnum):
    """The kind of thing that happened to an attempt."""

    CLAIMED = "claimed"
    HEARTBEAT = "heartbeat"
    DONE = "done"
    FAILED = "failed"
    DECLINED = "declined"


LOST = "lost"
"""The code of an attempt whose process died, or of which nothing is heard any more."""


class Failure(BaseModel):
    """The reason why an attempt failed."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    code: Name
    """The code of the error, as in `lippmann.errors`, or `LOST`."""
    message: Text
    """The sentence that a user reads."""
    permanent: bool
    """True if every other attempt would fail in the same way."""
    frame: Annotated[int, Field(ge=0, le=MAX_FRAME_NUMBER)] | None = None
    """The frame whose artifact is missing or cannot be read; None if the failure is about no single frame."""
    artifact: Name | None = None
    """The name of the artifact below the job that is missing or cannot be read; None if the failure names none."""


LONGEST_PROBE_S = 1e6
"""The bound of a probe's measurements, 12 days. A probe ends long before; the bound keeps the numbers of a plan
finite."""


MAX_PROBE_NOTES = 20
"""The greatest number of notes of a probe."""


class ProbeResult(BaseModel):
    """The measurements of the probe, which renders the first frame at low resolution."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    start_s: float = Field(ge=0, le=LONGEST_PROBE_S)
    """Seconds of a POV-Ray run that do not depend on the number of pixels: start and parse."""
    s_per_px: float = Field(ge=0, le=LONGEST_PROBE_S)
    """CPU seconds for one rendered pixel."""
    tileable: bool
    """True if tiles are equal to the same pixels of the whole frame; with radiosity they differ."""
    parallel: bool = False
    """True if one POV-Ray with several threads renders the same pixels as one with a single thread, and about as
    quickly as several that render tiles. So it is with glass and without anything that POV-Ray samples at random."""
    renders: bool = True
    """True if the job renders something; a job on imported sheets does not."""
    camera: SceneCamera | None = None
    """The scene's own camera at frame 1, if the stage of the job depends on it."""
    notes: Annotated[tuple[Text, ...], Field(max_length=MAX_PROBE_NOTES)] = ()
    """Notes on the scene for the people of the job, which are added to those that it has."""


class Event(BaseModel):
    """One event in the life of one attempt.

    A service ignores the fields that a newer worker adds, because a farm is upgraded one host after the other.
    """

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    kind: EventKind
    job_id: Name
    task_id: Name
    attempt: Name
    worker: WorkerName
    instance: Name | None = None
    """The start of the worker process; None if the worker is older than the field."""
    at_s: float
    """Seconds since 1970, UTC, on the worker's clock. It is informative; the stream defines the order."""
    progress: float | None = Field(default=None, ge=0, le=1)
    cpu_s: Seconds | None = None
    wall_s: Seconds | None = None
    failure: Failure | None = None
    probe: ProbeResult | None = None
    digests: Digests = Field(default_factory=dict)
    """The digests of the artifacts that the attempt stored, by their names below the job, in a `done` event."""
    cached: bool = False
    """True in a `done` event if the tile was taken from the render cache and nothing was rendered."""


class Lease(BaseModel):
    """The lease of an attempt. Its process renews it every second, and it expires when the process ends."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    attempt: Name | None = None
    """The attempt that is leased; None from a worker that is older than the field."""
    worker: Name
    instance: Name | None = None
    """The start of the worker process, as in the events of the attempt."""
    at_s: float
    """The time of the renewal, in seconds since 1970, UTC, on the worker's clock."""


class StopSignal(BaseModel):
    """The request of the service that an attempt stops. It holds for ever, so a repeated one changes nothing."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    attempt: Name


class NotClaiming(BaseModel):
    """The workers that take no orders, as the coordinator tells every process of the service."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    since_s: dict[Name, float]
    """The time since when, in seconds since 1970, by the name of the worker."""


class Directions(BaseModel):
    """The message of the coordinator to all workers: the queues that there are, and which workers are drained."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    requirements: tuple[Name, ...] = ()
    """The requirements of the open jobs that have one, as `JobRequirement.text`. Each has a queue of its own."""
    drains: dict[Name, bool] = Field(default_factory=dict)
    """The worker processes that take no further orders, by their `instance`; true for those that end afterwards."""
    release: Name
    """The version of Lippmann that the service runs."""
    protocol: int
    """The version of the messages of the service."""
    oldest_protocol: int
    """The oldest version that the service understands."""


class Closed(StrEnum):
    """The reason why a worker takes no orders by its own decision."""

    DRAINING = "draining"
    HOURS = "hours"
    VERSION = "version"


NO_POVRAY = "none"
"""The version of POV-Ray of a worker that has none."""


class PresenceFault(BaseModel):
    """The reason why a worker that is online can do no work now."""

    model_config = ConfigDict(frozen=True, extra="ignore")

    code: Name
    """The code of the error, as in `lippmann.errors`."""
    message: Text
    """The sentence that a user reads."""


class Presence(BaseModel):
    """A worker that is online. Its consumer publishes it every few seconds, and it expires when the worker stops.

    The times are seconds since 1970 on the worker's clock; only their differences mean something to others.
    """

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    name: WorkerName
    instance: Name | None = None
    """A random name of this start of the worker process; None if the worker is older than the field."""
    host: Name
    pid: int
    slots: Annotated[int, Field(ge=0, le=MAX_SLOTS)]
    sandbox: Name
    povray: Name
    version: Name
    started_s: float
    seen_s: float
    holds: tuple[Name, ...] | None = None
    """The attempts whose orders the worker has taken and not ended; None if the worker is older than the field."""
    consuming_s: float | None = None
    """The time at which the broker last answered a poll of the consumer, or no slot was free; None from workers that
    do not publish it, and before the first poll."""
    order_s: float | None = None
    """The time at which the consumer last took an order; None before the first one."""
    fault: PresenceFault | None = None
    """The reason why it can do no work now; None if it can, or if the worker is older than the field."""
    worker_key: Name | None = None
    """The id of the worker key that signed it; None from a worker without a key of its own."""
    refused_orders: int = Field(default=0, ge=0, lt=2**63)
    """The number of messages of the broker that it did not accept since it started: orders, stop signals, leases."""
    pool: Name = ""
    """The pool of the worker; empty if it is in none."""
    tags: tuple[Name, ...] = ()
    """The tags of the worker."""
    memory_mb: int | None = Field(default=None, ge=0, lt=2**63)
    """The memory that it gives one task, MB; None if the worker is older than the field."""
    engines: tuple[Name, ...] = ()
    """The engines that it has, such as `povray`."""
    engine_versions: dict[Name, Name] = Field(default_factory=dict)
    """The versions of those engines, by their names."""
    hours: Name | None = None
    """The hours in which it takes orders; None if it always does."""
    protocol: int = PROTOCOL_OF_OLD_WORKERS
    """The version of its messages."""
    oldest_protocol: int = PROTOCOL_OF_OLD_WORKERS
    """The oldest version that it understands."""
    closed: Name | None = None
    """The reason why it takes no orders by its own decision, one of `Closed`; None if it takes orders."""
    opens_s: float | None = None
    """The time at which its hours begin again, in seconds since 1970; None if that is not known."""
    previews: bool = False
    """True if it renders previews; False from a worker that is older than the field."""
    load: float | None = Field(default=None, ge=0, le=MAX_LOAD)
    """The load average of its machine over the last minute; None if it is not known."""
    cores: int | None = Field(default=None, ge=1, le=MAX_SLOTS)
    """The number of cores of its machine; None if the worker is older than the field."""

    @property
    def has_povray(self) -> bool:
        """True if it has POV-Ray; a worker that is older than the field `engines` names its version alone."""
        return "povray" in self.engines or (not self.engines and self.povray != NO_POVRAY)

    def lacks(self, requirement: JobRequirement) -> tuple[str, ...]:
        """Return what the worker lacks to do the tasks of a job, as parts of a sentence; empty if it lacks nothing."""
        engines = {*self.engines, "povray"} if self.has_povray else self.engines
        return requirement.lacks_of(pool=self.pool, tags=self.tags, memory_mb=self.memory_mb, engines=engines)

    def understands(self, protocol: int = PROTOCOL, oldest_protocol: int = OLDEST_PROTOCOL) -> bool:
        """Return whether the worker and a service of a version, by default this one, understand each other."""
        return understand_each_other((self.protocol, self.oldest_protocol), (protocol, oldest_protocol))
