"""Why a job or a task waits."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum
from types import MappingProxyType

from service.schemas.answer import Answer


class WaitCode(StrEnum):
    """The reason why a job or a task waits; docs/statuses.md has the table."""

    PAUSED = "paused"
    PAUSED_BY_FARM = "paused-by-farm"
    NO_COORDINATOR = "no-coordinator"
    PREPARATION = "preparation"
    VERIFICATION = "verification"
    FARM_FAULT = "farm-fault"
    BROKER_AWAY = "broker-away"
    NO_WORKER = "no-worker"
    NO_FITTING_WORKER = "no-fitting-worker"
    WORKERS_CLOSED = "workers-closed"
    NOT_CLAIMING = "not-claiming"
    EARLIER_STAGE = "earlier-stage"
    ARTIFACT_REPAIR = "artifact-repair"
    RETRY_DELAY = "retry-delay"
    DEFERRED = "deferred"
    WORKERS_AVOIDED = "workers-avoided"
    SLOT_LIMIT = "slot-limit"
    HIGHER_PRIORITY = "higher-priority"
    FAIR_SHARE = "fair-share"
    EARLIER_TASKS = "earlier-tasks"
    SLOTS_BUSY = "slots-busy"
    ORDER_SENT = "order-sent"
    STARTING = "starting"


_C = WaitCode

WAITS = MappingProxyType(
    {
        _C.PAUSED: "A user has paused the job.",
        _C.PAUSED_BY_FARM: "The farm has paused the job, because something prevents its work. It goes on by itself.",
        _C.NO_COORDINATOR: "No process of the service runs a coordinator, so nothing is dispatched.",
        _C.PREPARATION: "The coordinator plans the tasks of the job, or resets them for a retry.",
        _C.VERIFICATION: "The coordinator verifies the artifacts of the job.",
        _C.FARM_FAULT: "The store, the database, the broker or every worker is at fault, so nothing is dispatched.",
        _C.BROKER_AWAY: "The broker does not answer, so nothing is dispatched.",
        _C.NO_WORKER: "No worker is online.",
        _C.NO_FITTING_WORKER: "No worker that is online has the pool, the tags, the memory or the engine for it.",
        _C.WORKERS_CLOSED: "Every worker that may do it is drained, outside its hours, or of another version.",
        _C.NOT_CLAIMING: "Every worker that is online takes no orders although it has a free slot.",
        _C.EARLIER_STAGE: "It needs tasks that are not done.",
        _C.ARTIFACT_REPAIR: "It could not read an artifact, which is verified and made again if it is damaged.",
        _C.RETRY_DELAY: "An attempt failed, and the next one has to wait until `until_at`.",
        _C.DEFERRED: "A disk, the store, the sandbox or a missing engine prevented it. It waits until `until_at`.",
        _C.WORKERS_AVOIDED: "It avoids workers on which it or its job failed, and the others have no free slot.",
        _C.SLOT_LIMIT: "The job, or its owner's jobs, hold as many slots as the job file, the key or the farm allows.",
        _C.HIGHER_PRIORITY: "Jobs with a higher priority get the slots first.",
        _C.FAIR_SHARE: "Jobs of the same priority with fewer orders get the slots first.",
        _C.EARLIER_TASKS: "Tasks of the same job that come before it get the slots first.",
        _C.SLOTS_BUSY: "All slots are busy. It is the next one.",
        _C.ORDER_SENT: "Its order is in the queue, and all slots are busy.",
        _C.STARTING: "A slot is free for it, and it starts in a moment.",
    }
)
"""The meaning of each reason."""


class Wait(Answer):
    """Why a job or a task waits."""

    code: WaitCode
    """The reason; the table in docs/statuses.md explains each."""
    message: str
    """The sentence that a user reads. The fields below complete it."""
    fault: str | None = None
    """The code of the fault or of the error behind it, such as `store-full`."""
    until_at: datetime | None = None
    """The time until which it waits in any case; null if that is not known."""
    jobs: tuple[str, ...] = ()
    """The jobs that come first or hold the slots, up to ten, first the one that comes first."""
    tasks: tuple[str, ...] = ()
    """Tasks that must be done before, up to ten."""
    workers: tuple[str, ...] = ()
    """The workers that the reason is about: those that are avoided, or that take no orders."""
