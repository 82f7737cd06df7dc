"""One attempt at a task: acquire the lease, work, report."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import structlog
from redis.exceptions import RedisError

from lippmann.digest import Digest
from lippmann.errors import (
    NO_DISK,
    NO_ROOM,
    ArtifactBroken,
    ArtifactMissing,
    DiskFull,
    DiskUnavailable,
    LippmannError,
    Permanent,
    Stopped,
    StoreFull,
    StoreUnavailable,
)
from lippmann.job.messages.events import EventKind, Failure, ProbeResult
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.telemetry import span
from lippmann.untrusted.shown import shown
from worker.engines.povray.answers.diagnosis import NO_ROOM_BYTES
from worker.report import START_S, AttemptHeartbeat, event_of
from worker.sandbox.child import lost_cpu
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.whole_file import check_folder

log = structlog.get_logger()


REASON_CHARS = 500
"""The longest reason in the log."""
DECLINE_PAUSE_S = 1.0
"""A worker that declines an order waits, so that it does not empty the queue before the workers that may take it."""

_NO_FAILURES = frozenset({"done", "declined", "not-begun"})
HUNG_S = {
    TaskKind.PROBE: 90_000.0,
    TaskKind.RENDER: 90_000.0,
    TaskKind.ASSEMBLE: 3600.0,
    TaskKind.ENCODE: 3600.0,
}
"""Work that makes no progress and does not ask whether to stop for this long is hung and is killed. Work that waits for
an engine asks all the time, so an engine that shows no progress for days is ended by the limits of its job alone."""


@dataclass(frozen=True)
class TaskResult:
    """The result of an attempt that succeeded."""

    probe: ProbeResult | None = None
    digests: Mapping[str, Digest] = field(default_factory=dict)
    """The digests of the artifacts that the task stored, by their names below the job."""
    cached: bool = False
    """True if the tile was taken from the render cache."""


TaskFunction = Callable[[Workplace, Order, ProgressMonitor], TaskResult]


def attempt(place: Workplace, order: Order, do: TaskFunction) -> None:
    """Execute an order once and report how it ended.

    Nothing happens if the service has requested a stop, or if another delivery of the order holds the lease. While the
    broker is unreachable, the attempt waits before it begins, and it keeps its final event until the stream has it.
    Every line that is logged meanwhile carries the ids of the job, the task and the attempt.
    """
    ids = {"job": order.job_id, "task": order.task_id, "attempt": order.attempt}
    with (
        structlog.contextvars.bound_contextvars(**ids),
        span(f"attempt {order.kind}", parent=order.trace, worker=place.broker.worker, **ids) as made,
    ):
        outcome = _attempt(place, order, do)
        made.note(outcome=outcome)
        if outcome not in _NO_FAILURES:
            made.fail(outcome)


def _attempt(place: Workplace, order: Order, do: TaskFunction) -> str:
    """Return how the attempt ended: `done`, `declined`, `not-begun`, or the code of its error."""
    broker = place.broker
    begin = partial(broker.patiently, within_s=START_S, stopping=place.stopping)
    if broker.worker in order.avoid:
        begin(lambda: broker.publish(event_of(order, EventKind.DECLINED, broker)))
        time.sleep(DECLINE_PAUSE_S)
        return "declined"
    lease = broker.new_lease(order.attempt)
    if not begin(lambda: broker.claim(order, lease)):
        return "not-begun"
    started_s, started_cpu_s = time.monotonic(), _cpu_s()
    with AttemptHeartbeat(
        broker, order, worker_stopping=place.stopping, hung_s=HUNG_S[order.kind], announce=place.announce
    ) as heartbeat:
        work, failure = _done_or_failed(place, order, do, heartbeat)
    final = event_of(
        order,
        EventKind.FAILED if failure else EventKind.DONE,
        broker,
        cpu_s=max(0.0, _cpu_s() - started_cpu_s),
        wall_s=time.monotonic() - started_s,
        failure=failure,
        probe=work.probe,
        digests=work.digests,
        cached=work.cached,
    )
    publish = partial(broker.publish_final, final)
    try:
        broker.patiently(publish, within_s=place.settings.final_event_s, stopping=place.stopping)
    except RedisError as error:
        # The service notices the artifact, or that the heartbeats are missing. The lease expires by itself.
        log.warning("final event lost", error=repr(error))
    return "done" if failure is None else failure.code


def _cpu_s() -> float:
    """Return the CPU seconds of this process and of all below it that have ended; it makes one attempt at a time."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return time.process_time() + used.ru_utime + used.ru_stime + lost_cpu.seconds


def _done_or_failed(
    place: Workplace, order: Order, do: TaskFunction, monitor: ProgressMonitor
) -> tuple[TaskResult, Failure | None]:
    try:
        place.store.expect(order.store_id)
        return do(place, order, monitor), None
    except Exception as error:  # the outermost frame of a task: every error is reported, and the worker goes on
        failure = _disk_failure(place, error) or failure_of(error)
        reason, is_unknown = shown(failure.message, length=REASON_CHARS), not isinstance(error, LippmannError)
        log.warning("attempt failed", code=failure.code, reason=reason, exc_info=is_unknown)
        return TaskResult(), failure


def _disk_failure(place: Workplace, error: Exception) -> Failure | None:
    """Return the fault of the scratch disk that an attempt failed by, whatever the program said that met it."""
    if isinstance(error, Stopped | StoreFull | StoreUnavailable):
        return None
    try:
        check_folder(place.settings.scratch_dir, reserve_bytes=NO_ROOM_BYTES)
    except LippmannError as fault:
        return failure_of(fault)
    return None


def failure_of(error: Exception) -> Failure:
    """Return an error as an event carries it; errors that are not LippmannErrors count as transient."""
    if isinstance(error, OSError) and error.errno in NO_ROOM:
        error = DiskFull(f"expected room in the worker's scratch folder, got: {error}")
    elif isinstance(error, OSError) and error.errno in NO_DISK:
        error = DiskUnavailable(f"expected a scratch folder of the worker that can be written, got: {error}")
    if isinstance(error, LippmannError):
        about = error if isinstance(error, ArtifactBroken | ArtifactMissing) else None
        return Failure(
            code=error.code,
            message=error.message,
            permanent=isinstance(error, Permanent),
            frame=about and about.frame,
            artifact=about and about.artifact,
        )
    return Failure(code="unexpected", message=f"{type(error).__name__}: {error}", permanent=False)
