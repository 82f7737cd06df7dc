"""The retry policy: the consequences of a failed attempt for its task and for its worker."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.errors import (
    DiskFull,
    DiskUnavailable,
    OutOfMemory,
    ParseTimedOut,
    PhotonsTimedOut,
    PovrayMissing,
    RenderTimedOut,
    SandboxMissing,
    Stopped,
    StoreFull,
    StoreUnavailable,
)
from lippmann.job.messages.events import LOST, Failure
from lippmann.job.states import TaskStatus
from service.db.tables import Task, WorkerFault
from service.jobs.state_machine import transition_task
from service.settings import Settings

LONGEST_DEFERRAL_S = 600.0
"""The longest pause before the next attempt of a deferred task."""
INFRASTRUCTURE = frozenset(
    kind.code for kind in (StoreFull, StoreUnavailable, DiskFull, DiskUnavailable, SandboxMissing, PovrayMissing)
)
"""Failures that any other task would have met too. They do not count against the task, which is deferred."""

DETERMINISTIC = frozenset({RenderTimedOut.code, ParseTimedOut.code, PhotonsTimedOut.code, OutOfMemory.code})
"""Failures by a limit of the job. A task that fails twice in a row in the same one of these ways always does."""


def fail_attempt(
    session: Session, task: Task, failure: Failure, *, worker: str | None, now_s: float, settings: Settings
) -> bool:
    """Record the failure of an attempt: the task becomes ready or failed; False if the attempt no longer owns it.

    A stopped attempt counts against nobody. A lost one counts against the task, since a task may kill its workers, but
    not against the worker, which may have been killed by something else.
    """
    if failure.code == Stopped.code:
        return transition_task(session, task, TaskStatus.READY, progress=None)
    if failure.code in INFRASTRUCTURE and not failure.permanent:
        return _defer(session, task, failure, worker=worker, now_s=now_s, settings=settings)
    if failure.code in DETERMINISTIC and failure.code == task.error_code:
        failure = failure.model_copy(update={"permanent": True})
    failures = task.failures + 1
    failed_on = list(dict.fromkeys([*task.failed_on, *([worker] if worker else [])]))
    values = {"failures": failures, "failed_on": failed_on, **_columns(failure)}
    if failure.permanent or failures >= settings.failures_allowed:
        values |= {"permanent": failure.permanent, "ended_s": now_s}
        changed = transition_task(session, task, TaskStatus.FAILED, **values)
    else:
        pause_s = settings.retry_pause_s * 2 ** (failures - 1)
        changed = transition_task(session, task, TaskStatus.READY, **values, not_before_s=now_s + pause_s)
    if changed and worker and failure.code != LOST and not failure.permanent:
        _blame(session, task.job_id, worker, now_s=now_s, settings=settings)
    return changed


def _defer(
    session: Session, task: Task, failure: Failure, *, worker: str | None, now_s: float, settings: Settings
) -> bool:
    """Defer a task that something outside it prevented, with the reason in its row, and avoid the worker meanwhile.

    If it prevents every worker, `service.coordinator.fault_monitor` pauses the job.
    """
    pause_s = min(LONGEST_DEFERRAL_S, settings.deferral_s * 2.0 ** min(task.deferrals, 20))
    values = {"deferrals": task.deferrals + 1, **_columns(failure), "not_before_s": now_s + pause_s}
    changed = transition_task(session, task, TaskStatus.READY, **values)
    if changed and worker:
        fault = _fault(session, task.job_id, worker)
        fault.avoided_until_s, fault.code, fault.message = now_s + pause_s, failure.code, failure.message
        session.flush()
    return changed


def _columns(failure: Failure) -> dict[str, object]:
    return {
        "error_code": failure.code,
        "error_message": failure.message,
        "error_frame": failure.frame,
        "error_artifact": failure.artifact and failure.artifact[:200],
        "progress": None,
    }


def _blame(session: Session, job_id: str, worker: str, *, now_s: float, settings: Settings) -> None:
    fault = _fault(session, job_id, worker)
    fault.failures += 1
    if fault.failures >= settings.avoid_after:
        fault.failures, fault.avoided_until_s = 0, now_s + settings.avoid_s
    session.flush()


def _fault(session: Session, job_id: str, worker: str) -> WorkerFault:
    fault = session.get(WorkerFault, (job_id, worker)) or WorkerFault(job_id=job_id, worker=worker, failures=0)
    session.add(fault)
    return fault
