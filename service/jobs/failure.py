"""What a failed attempt means for its task and for the worker that tried."""

from __future__ import annotations

from sqlalchemy.orm import Session

from service.db.tables import Task, WorkerFault
from service.db.tally import move_task
from service.settings import Settings
from worker.errors import Stopped
from worker.job.events import Failure
from worker.job.statuses import TaskStatus

LOST = "lost"


def fail_attempt(
    session: Session, task: Task, failure: Failure, *, worker: str | None, now_s: float, settings: Settings
) -> bool:
    """Write down that an attempt failed: the task goes back, or has failed; False if it is no longer the attempt's.

    A stopped attempt counts for nothing. A lost one counts for the task, since a task may kill its workers, but not
    against the worker, since workers are also killed by others.
    """
    if failure.code == Stopped.code:
        return move_task(session, task, TaskStatus.READY, progress=None)
    failures = task.failures + 1
    failed_on = list(dict.fromkeys([*task.failed_on, *([worker] if worker else [])]))
    ended = failure.permanent or failures >= settings.failures_allowed
    values = {
        "failures": failures,
        "failed_on": failed_on,
        "error_code": failure.code,
        "error_message": failure.message,
        "progress": None,
    }
    if ended:
        moved = move_task(session, task, TaskStatus.FAILED, **values, permanent=failure.permanent, ended_s=now_s)
    else:
        pause_s = settings.retry_pause_s * 2 ** (failures - 1)
        moved = move_task(session, task, TaskStatus.READY, **values, not_before_s=now_s + pause_s)
    if moved and worker and failure.code != LOST and not failure.permanent:
        _blame(session, task.job_id, worker, now_s=now_s, settings=settings)
    return moved


def _blame(session: Session, job_id: str, worker: str, *, now_s: float, settings: Settings) -> None:
    fault = session.get(WorkerFault, (job_id, worker)) or WorkerFault(job_id=job_id, worker=worker, failures=0)
    fault.failures += 1
    if fault.failures >= settings.avoid_after:
        fault.failures, fault.until_s = 0, now_s + settings.avoid_s
    session.add(fault)
    session.flush()
