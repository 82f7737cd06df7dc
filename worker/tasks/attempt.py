"""One attempt: lease, work, report."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import structlog

from lippmann.errors import NO_ROOM, ArtifactBroken, ArtifactMissing, LippmannError, Permanent, StoreFull
from lippmann.job.events import EventKind, Failure, ProbeResult
from lippmann.job.orders import Order, TaskKind
from worker.report import Heart, event_of
from worker.tasks.watch import Watch
from worker.tasks.workplace import Workplace

log = structlog.get_logger()


DECLINE_PAUSE_S = 1.0
"""A worker that declines rests, so that it does not empty the queue before those that may take from it."""

HUNG_S = {
    TaskKind.PROBE: 90_000.0,
    TaskKind.RENDER: 90_000.0,
    TaskKind.ASSEMBLE: 3600.0,
    TaskKind.ENCODE: 3600.0,
}
"""Work without progress for so long hangs beyond help. A render has its job's limits, a day at most, before that."""


@dataclass(frozen=True)
class Work:
    """What an attempt that ended well has to say."""

    cpu_s: float = 0.0
    """CPU seconds of the processes it ran; the attempt adds its own."""
    probe: ProbeResult | None = None


Doing = Callable[[Workplace, Order, Watch], Work]


def attempt(place: Workplace, order: Order, do: Doing) -> None:
    """Try an order once and report how it ended; silently, if the attempt is not ours to make.

    An order that was called back, or that another delivery of is at work, is left alone.
    """
    line, worker = place.line, place.line.worker
    if worker in order.avoid:
        line.say(event_of(order, EventKind.DECLINED, worker))
        time.sleep(DECLINE_PAUSE_S)
        return
    if line.told_to_stop(order.attempt) or not line.take_lease(order.attempt):
        return
    line.say(event_of(order, EventKind.CLAIMED, worker))
    started_s, started_cpu_s = time.monotonic(), time.process_time()
    with Heart(line, order, worker_stopping=place.stopping, hung_s=HUNG_S[order.kind]) as heart:
        work, failure = _done_or_failed(place, order, do, heart)
    line.say_at_last(
        event_of(
            order,
            EventKind.FAILED if failure else EventKind.DONE,
            worker,
            cpu_s=work.cpu_s + time.process_time() - started_cpu_s,
            wall_s=time.monotonic() - started_s,
            failure=failure,
            probe=work.probe,
        )
    )
    line.drop_lease(order.attempt)


def _done_or_failed(place: Workplace, order: Order, do: Doing, watch: Watch) -> tuple[Work, Failure | None]:
    try:
        return do(place, order, watch), None
    except Exception as error:  # the outermost frame of a task: whatever it was is said, and the worker lives on
        failure = failure_of(error)
        log.warning("attempt failed", job=order.job_id, task=order.task_id, attempt=order.attempt, code=failure.code,
                    exc_info=not isinstance(error, LippmannError))  # fmt: skip
        return Work(), failure


def failure_of(error: Exception) -> Failure:
    """Return what an event says of an error; ones that are not ours count as transient."""
    if isinstance(error, OSError) and error.errno in NO_ROOM:
        error = StoreFull(f"expected room in the worker's scratch folder, got: {error}")
    if isinstance(error, LippmannError):
        frame = error.frame if isinstance(error, ArtifactBroken | ArtifactMissing) else None
        return Failure(code=error.code, message=error.message, permanent=isinstance(error, Permanent), frame=frame)
    return Failure(code="unexpected", message=f"{type(error).__name__}: {error}", permanent=False)
