"""Health and workers."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from service.schemas.answer import Answer, RequestBody


class Fault(Answer):
    """A cause that prevents work: a disk that is full, cannot be written or is away, or a worker without its tools."""

    component: Literal["store", "database", "broker", "workers"]
    code: str
    """The code of the cause, such as `store-full`."""
    message: str
    """The sentence that a user reads."""
    since_s: float
    """The time at which the cause was noticed, in seconds since 1970."""


class ComponentHealth(Answer):
    """The health of a component that the service needs."""

    ok: bool
    detail: str
    """`answers`, the kind of the error, or the sentence of a fault; empty without a key. A broker that loses orders in
    a restart says so."""


class StoreHealth(Answer):
    """The health of the artifact store."""

    ok: bool
    detail: str
    """`answers`, or the kind of the error; empty without a key."""
    free_bytes: int | None
    """The free space in bytes; null if the store does not answer or has no limit, and without a key."""


class CoordinatorHealth(Answer):
    """The health of the coordinator, which schedules tasks and records events."""

    ok: bool
    """True if a coordinator is running in some service process."""
    leader: str | None
    """The process whose coordinator runs; null without a key."""


class DroppedMessages(Answer):
    """The messages of the broker that were refused, because they were not signed or could not be read."""

    events: int
    """Messages in the stream of events."""
    presences: int
    """Messages of workers that are online. One that stays in the broker counts each time it is read, once a second."""
    leases: int = 0
    """Leases of attempts."""
    orders: int | None
    """Orders, stop signals and leases that the workers that are online did not accept since they started; null if the
    broker does not answer."""


class Health(Answer):
    """The health of the farm."""

    status: Literal["ok", "degraded"]
    """`ok` if every component is and every worker takes orders."""
    version: str
    """The version of Lippmann; empty without a key."""
    database: ComponentHealth
    broker: ComponentHealth
    store: StoreHealth
    coordinator: CoordinatorHealth
    workers: int | None
    """The number of workers that are online; null if the broker does not answer, and without a key."""
    slots: int | None
    """The number of the slots of those that take orders; null if the broker does not answer, and without a key."""
    sandboxes: tuple[str, ...] | None = None
    """The kinds of sandboxes of the workers that are online; null without a key, and if the broker does not answer."""
    faults: tuple[Fault, ...] = ()
    """The causes that prevent work now, first cause first; empty without a key. The farm has paused its running jobs
    until all of them are gone."""
    notes: tuple[str, ...] = ()
    """Remarks on things that prevent no work, such as workers of another release; empty without a key."""
    dropped: DroppedMessages | None = None
    """The messages that the coordinator and the workers refused; null unless an admin asks, and without a database."""


class Worker(Answer):
    """A worker that is online."""

    name: str
    host: str
    pid: int
    slots: int
    """The number of tasks that it runs at the same time."""
    sandbox: str
    povray: str
    """The version of POV-Ray."""
    version: str
    """The version of Lippmann."""
    started_s: float
    """Seconds since 1970."""
    seen_s: float
    """The time of its last sign of life, in seconds since 1970."""
    running: int
    """The number of tasks of open jobs that it runs."""
    fault: str | None = None
    """The reason why it can do no work now, such as a scratch disk without room."""
    refused_orders: int = 0
    """The number of orders, stop signals and leases that it did not accept, because they were not signed or could not
    be read."""
    pool: str = ""
    """The pool of the worker, whose jobs alone it does; empty for a worker that does the jobs without a pool."""
    tags: tuple[str, ...] = ()
    """The tags of the worker, for which jobs ask."""
    memory_mb: int | None = None
    """The memory that it gives one task, MB; null if it is older than this field."""
    engines: tuple[str, ...] = ()
    """The engines that it has, such as `povray`; it does the tasks of jobs that need one of these."""
    engine_versions: dict[str, str] = Field(default_factory=dict)
    """The versions of those engines, by their names."""
    hours: str | None = None
    """The hours in which it takes orders, such as `Mon-Fri 19:00-07:00`; null if it always does."""
    protocol: int = 1
    """The version of the messages that it sends."""
    closed: str | None = None
    """The reason why it takes no orders: `draining`, `hours` or `version`; null if it takes some."""
    opens_s: float | None = None
    """The time at which its hours begin again, in seconds since 1970; null if it is not outside them."""
    version_note: str | None = None
    """The sentence on its release and that of the service, if they differ."""
    load: float | None = None
    """The load average of its machine over the last minute; null if it does not say it."""
    cores: int | None = None
    """The number of cores of its machine; null if it does not say it."""
    drained: bool = False
    """True if an admin has drained it, which an admin can undo."""
    excluded: bool = False
    """True if an admin has excluded it."""
    avoided_by: int = 0
    """The number of open jobs that avoid it now, because their tasks failed there."""
    previews: bool = False
    """True if it renders previews."""
    not_claiming_since_s: float | None
    """The time since when it takes no orders although it has a free slot, in seconds since 1970; null if it does."""


class WaitingWork(Answer):
    """The work that waits for slots and that has some, as the database has it now."""

    waiting_tasks: int
    """The number of tasks that wait for a slot and nothing else, orders that no worker has taken included. Tasks of
    paused jobs do not wait for a slot."""
    running_tasks: int
    """The number of tasks that workers run."""
    wanted_slots: int
    """The number of slots that would have work now: running tasks, and waiting ones as far as the limits of slots of
    their owners allow."""


class DrainRequest(RequestBody):
    """A request to drain a worker."""

    ends: bool = False
    """True if the worker process ends, with the exit code 0, when it has finished its tasks."""


class ExcludedWorker(Answer):
    """A worker that takes no orders until an admin includes it again."""

    worker: str
    name: str
    """The name of the key of the admin who excluded it."""
    since_s: float
    """The time at which it was excluded, in seconds since 1970."""


class WorkerList(Answer):
    """The workers that are online, sorted by name."""

    items: tuple[Worker, ...]
    known: bool
    """False if the broker does not answer; the list is empty then."""
    excluded: tuple[ExcludedWorker, ...] = ()
    """The workers that are excluded, online or not."""
