"""The retry policy: the consequences of a failed attempt for its task and for its worker. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.errors import (
    ArtifactBroken,
    ArtifactMissing,
    DiskFull,
    DiskUnavailable,
    MitsubaMissing,
    OutOfMemory,
    ParseTimedOut,
    PhotonsTimedOut,
    PovrayMissing,
    RenderCrashed,
    RenderStalled,
    RenderTimedOut,
    SandboxMissing,
    Stopped,
    StoreFull,
    StoreUnavailable,
    WorkerOutdated,
)
from lippmann.job.messages.events import LOST, Failure
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.instruments import Outcome
from service.jobs.task_draft import TaskDraft
from service.settings import Settings

DAMAGED = frozenset({ArtifactMissing.code, ArtifactBroken.code})
"""Failures that are about an artifact that the attempt read."""
_READERS = frozenset({TaskKind.ASSEMBLE, TaskKind.ENCODE})
"""The kinds of tasks that read what other tasks made."""
LONGEST_PAUSE_S = 600.0
"""The longest pause before the next attempt of a task that failed, was lost or deferred."""
_OUTSIDE = (
    StoreFull, StoreUnavailable, DiskFull, DiskUnavailable, SandboxMissing, PovrayMissing, MitsubaMissing,
    WorkerOutdated,
)  # fmt: skip
INFRASTRUCTURE = frozenset(kind.code for kind in _OUTSIDE)
"""Failures that any other task would have met too. They do not count against the task, which is deferred."""

TIMEOUTS = frozenset(kind.code for kind in (RenderTimedOut, ParseTimedOut, PhotonsTimedOut, RenderStalled))
"""Failures by a limit of time. Which of them ends an endless scene depends on what the scene prints."""
DETERMINISTIC = TIMEOUTS | {OutOfMemory.code, RenderCrashed.code}
"""Failures that repeat. A task that fails twice in a row in the same one of these ways, or by two limits of time, would
always do so. The second attempt is on another worker if there is one."""


def longest_pause_s(settings: Settings) -> float:
    """Return the longest pause before the next attempt of a task, and for which a job avoids a worker."""
    return max(LONGEST_PAUSE_S, settings.avoid_s, settings.decline_pause_s)


def doubled_pause_s(first_s: float, times: int) -> float:
    """Return a pause that was doubled a number of times, and is bounded.

    >>> doubled_pause_s(2.0, 0), doubled_pause_s(2.0, 3), doubled_pause_s(2.0, 5000)
    (2.0, 16.0, 600.0)
    """
    return min(LONGEST_PAUSE_S, first_s * 2.0 ** min(times, 20))


@dataclass(frozen=True)
class Prevention:
    """The reason why a worker cannot work, and the time until which a job avoids it."""

    until_s: float
    code: str
    message: str


@dataclass(frozen=True)
class Fault:
    """A failure that counts against a worker for the tasks of a job."""

    job_id: str
    worker: str
    prevention: Prevention | None = None
    """The cause that prevented the work; None if the task failed for another reason, which only counts."""


def fail_attempt(
    draft: TaskDraft, failure: Failure, *, worker: str | None, now_s: float, settings: Settings
) -> Fault | None:
    """Apply a failure to the task, which becomes ready or failed; return what counts against the worker.

    A stopped attempt counts against nobody. A lost one counts neither as a failure of the task nor against the worker,
    which may have been killed by something else; it has a limit of its own, since a task may kill its workers. A task
    that could not read an artifact waits.
    """
    if failure.code == Stopped.code:
        draft.transition(TaskStatus.READY, progress=None)
        return None
    if failure.code == LOST:
        _lose(draft, failure, worker=worker, now_s=now_s, settings=settings)
        return None
    if failure.code in INFRASTRUCTURE and not failure.permanent:
        return _defer(draft, failure, worker=worker, now_s=now_s, settings=settings)
    if _repeats(failure.code, draft.now.error_code):
        failure = failure.model_copy(update={"permanent": True})
    if failure.code in DAMAGED and draft.now.kind in _READERS:
        # The artifact repairer verifies what the task could not read, and decides.
        draft.transition(TaskStatus.WAITING, **_columns(failure))
        return None
    failures = draft.now.failures + 1
    draft.set(failures=failures, failed_on=_failed_on(draft, worker), **_columns(failure))
    if failure.permanent or failures >= settings.failures_allowed:
        draft.transition(TaskStatus.FAILED, permanent=failure.permanent, ended_s=now_s)
    else:
        draft.transition(TaskStatus.READY, not_before_s=now_s + doubled_pause_s(settings.retry_pause_s, failures - 1))
    if worker and not failure.permanent:
        return Fault(draft.now.job_id, worker)
    return None


def outcome_of(failure: Failure) -> Outcome:
    """Return how an attempt ended that failed.

    >>> str(outcome_of(Failure(code="store-full", message="no room", permanent=False)))
    'deferred'
    """
    if failure.code == Stopped.code:
        return Outcome.STOPPED
    if failure.code == LOST:
        return Outcome.LOST
    return Outcome.DEFERRED if failure.code in INFRASTRUCTURE and not failure.permanent else Outcome.FAILED


def _repeats(code: str, before: str | None) -> bool:
    """Return whether a failure and the one before it show that every attempt fails.

    >>> _repeats("parse-timeout", "render-stalled"), _repeats("out-of-memory", "render-crashed")
    (True, False)
    """
    return (code in DETERMINISTIC and code == before) or {code, before} <= TIMEOUTS


def _lose(draft: TaskDraft, failure: Failure, *, worker: str | None, now_s: float, settings: Settings) -> None:
    """Count a lost attempt; the first one is repeated at once, and each further one after a longer pause."""
    losses = draft.now.losses + 1
    draft.set(losses=losses, failed_on=_failed_on(draft, worker), **_columns(failure))
    if losses >= settings.losses_allowed:
        why = f"{failure.message}; {losses} attempts were lost with their workers, so the task is not tried again"
        draft.transition(TaskStatus.FAILED, error_message=why, ended_s=now_s)
    else:
        pause_s = min(LONGEST_PAUSE_S, settings.retry_pause_s * (losses - 1))
        draft.transition(TaskStatus.READY, not_before_s=now_s + pause_s)


def _failed_on(draft: TaskDraft, worker: str | None) -> list[str]:
    return list(dict.fromkeys([*draft.now.failed_on, *([worker] if worker else [])]))


def _defer(draft: TaskDraft, failure: Failure, *, worker: str | None, now_s: float, settings: Settings) -> Fault | None:
    """Defer a task that something outside it prevented, with the reason in its row, and avoid the worker meanwhile.

    If it prevents every worker, `service.coordinator.fault_monitor` pauses the job.
    """
    due_s = now_s + doubled_pause_s(settings.deferral_s, draft.now.deferrals)
    draft.set(deferrals=draft.now.deferrals + 1, **_columns(failure))
    draft.transition(TaskStatus.READY, not_before_s=due_s)
    return Fault(draft.now.job_id, worker, Prevention(due_s, failure.code, failure.message)) if worker else None


def _columns(failure: Failure) -> dict[str, object]:
    return {
        "error_code": failure.code,
        "error_message": failure.message,
        "error_frame": failure.frame,
        "error_artifact": failure.artifact and failure.artifact[:200],
        "progress": None,
    }
