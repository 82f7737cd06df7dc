"""What a failed attempt means for its task and for the worker that tried."""

from __future__ import annotations

from sqlalchemy.orm import Session

from lippmann.errors import PovrayMissing, SandboxMissing, Stopped, StoreFull, StoreUnavailable
from lippmann.job.events import Failure
from lippmann.job.states import TaskStatus
from service.db.counters import move_task
from service.db.tables import Task, WorkerFault
from service.settings import Settings

LOST = "lost"
_WORKER_LACKS = frozenset({SandboxMissing.code, PovrayMissing.code})
INFRASTRUCTURE = frozenset({StoreUnavailable.code, StoreFull.code}) | _WORKER_LACKS
"""Failures that say nothing of the task: the same would have met any other. The task rests and is not blamed."""


def fail_attempt(
    session: Session, task: Task, failure: Failure, *, worker: str | None, now_s: float, settings: Settings
) -> bool:
    """Write down that an attempt failed: the task goes back, or has failed; False if it is no longer the attempt's.

    A stopped attempt counts for nothing. A lost one counts for the task, since a task may kill its workers, but not
    against the worker, since workers are also killed by others.
    """
    if failure.code == Stopped.code:
        return move_task(session, task, TaskStatus.READY, progress=None)
    if failure.code in INFRASTRUCTURE and not failure.permanent:
        return _rest(session, task, failure, worker=worker, now_s=now_s, settings=settings)
    failures = task.failures + 1
    failed_on = list(dict.fromkeys([*task.failed_on, *([worker] if worker else [])]))
    values = {"failures": failures, "failed_on": failed_on, **_said(failure)}
    if failure.permanent or failures >= settings.failures_allowed:
        moved = move_task(session, task, TaskStatus.FAILED, **values, permanent=failure.permanent, ended_s=now_s)
    else:
        pause_s = settings.retry_pause_s * 2 ** (failures - 1)
        moved = move_task(session, task, TaskStatus.READY, **values, not_before_s=now_s + pause_s)
    if moved and worker and failure.code != LOST and not failure.permanent:
        _blame(session, task.job_id, worker, now_s=now_s, settings=settings)
    return moved


def _rest(
    session: Session, task: Task, failure: Failure, *, worker: str | None, now_s: float, settings: Settings
) -> bool:
    """Let a task wait until the farm is mended, with the reason in its row; not for ever."""
    values = {"rests": task.rests + 1, **_said(failure)}
    if task.rests >= settings.rests_allowed:
        moved = move_task(session, task, TaskStatus.FAILED, **values, ended_s=now_s)
    else:
        moved = move_task(session, task, TaskStatus.READY, **values, not_before_s=now_s + settings.rest_s)
    if moved and worker and failure.code in _WORKER_LACKS:
        _fault(session, task.job_id, worker).until_s = now_s + settings.avoid_s
        session.flush()
    return moved


def _said(failure: Failure) -> dict[str, object]:
    return {"error_code": failure.code, "error_message": failure.message, "progress": None}


def _blame(session: Session, job_id: str, worker: str, *, now_s: float, settings: Settings) -> None:
    fault = _fault(session, job_id, worker)
    fault.failures += 1
    if fault.failures >= settings.avoid_after:
        fault.failures, fault.until_s = 0, now_s + settings.avoid_s
    session.flush()


def _fault(session: Session, job_id: str, worker: str) -> WorkerFault:
    fault = session.get(WorkerFault, (job_id, worker)) or WorkerFault(job_id=job_id, worker=worker, failures=0)
    session.add(fault)
    return fault
