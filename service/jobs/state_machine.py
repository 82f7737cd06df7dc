"""The state machine of jobs and tasks.

Every transition is guarded twice: by the tables of `lippmann.job.states`, and by the status that the row had when it
was read. Tasks are changed in memory, see `service.jobs.task_draft`, and written in sets, by a handful of statements
for any number of tasks and jobs.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from types import MappingProxyType
from typing import Any

from sqlalchemy import update
from sqlalchemy.orm import Session

from lippmann.job.states import JOB_ACTIONS, JOB_TRANSITIONS, JobAction, JobStatus, TaskStatus, actions_for
from service.db import attempts as attempt_rows
from service.db import coordinator as coordinator_rows
from service.db import jobs as job_rows
from service.db import task_sets
from service.db import tasks as task_rows
from service.db.attempts import Ended
from service.db.counters import add_to_counters
from service.db.engine import changed
from service.db.tables import Job, Task
from service.errors import JobNotEnded, NotFound, TransitionNotAllowed
from service.events.publish import publish_jobs, publish_tasks
from service.jobs.task_draft import TaskDraft, check_transition
from service.webhooks.outbox import store_message

RESET = {
    "failures": 0,
    "losses": 0,
    "failed_on": [],
    "deferrals": 0,
    "error_code": None,
    "error_message": None,
    "error_frame": None,
    "error_artifact": None,
    "repairs": 0,
    "permanent": False,
    "not_before_s": None,
    "ended_s": None,
}
"""The columns of a task that a retry resets."""


def find_job(session: Session, job_id: str) -> Job:
    """Return the row of a job.

    Raises
    ------
    NotFound
        If the job does not exist.
    """
    row = job_rows.job(session, job_id)
    if row is None:
        raise NotFound(f"there is no job {job_id!r}")
    return row


def find_job_for(session: Session, job_id: str, action: JobAction) -> Job:
    """Return the row of a job on which an action is allowed.

    Raises
    ------
    NotFound
        If the job does not exist.
    TransitionNotAllowed, JobNotEnded
        If the action is not allowed in the status of the job.
    """
    row = find_job(session, job_id)
    allowed = JOB_ACTIONS[action].allowed_in
    if action not in actions_for(row.status, row.paused_by, skipped=row.skipped):
        error = JobNotEnded if action is JobAction.REMOVE else TransitionNotAllowed
        *most, last = (status.value for status in JobStatus if status in allowed)
        words = f"{', '.join(most)} or {last}" if most else last
        raise error(f"cannot {action} a job that is {row.status}; expected one that is {words}")
    return row


def transition_job(session: Session, row: Job, to: JobStatus, **values: Any) -> Job:
    """Change the status of a job from the one that was read, publish it, and store the message of its webhook.

    Raises
    ------
    TransitionNotAllowed
        If the table has no such transition, or the status changed in the meantime.
    """
    if to not in JOB_TRANSITIONS[row.status]:
        raise TransitionNotAllowed(f"a job that is {row.status} cannot become {to}")
    statement = update(Job).where(Job.id == row.id, Job.status == row.status).values(status=to, **values)
    if changed(session, statement) == 0:
        raise TransitionNotAllowed(f"the job is no longer {row.status}, so it cannot become {to}")
    session.refresh(row)
    publish_jobs(session, [row])
    store_message(session, row)
    return row


def begin_jobs(session: Session, job_ids: Collection[str], *, now_s: float) -> None:
    """Change the status of those jobs that are queued to probing, and publish them."""
    queued = [job_id for job_id, status in job_rows.statuses(session, job_ids) if status is JobStatus.QUEUED]
    if queued:
        begun = update(Job).where(Job.id.in_(queued), Job.status == JobStatus.QUEUED)
        changed(session, begun.values(status=JobStatus.PROBING, started_s=now_s))
        publish_jobs(session, job_rows.jobs(session, queued))


def set_job(session: Session, row: Job, **values: Any) -> Job:
    """Change other columns of a job than its status."""
    changed(session, update(Job).where(Job.id == row.id).values(**values))
    session.refresh(row)
    return row


def write_drafts(
    session: Session, drafts: Iterable[TaskDraft], *, now_s: float, late: Mapping[str, int] = MappingProxyType({})
) -> None:
    """Write what rules changed in memory, make ready the tasks whose needs are done by it, and publish it.

    The counters of each job are changed by the same transaction, together with the number of its `late` events.

    Raises
    ------
    StaleRead
        If a task is no longer as it was read.
    """
    written = [draft for draft in drafts if draft.values]
    task_sets.write(session, [(draft.read, draft.values) for draft in written])
    ended = [Ended(draft.now, draft.values.get("error_code")) for draft in written if draft.has_ended_attempt]
    attempt_rows.keep(session, ended, ended_s=now_s)
    gains: dict[str, dict[str, float]] = defaultdict(dict)
    for draft in written:
        _add(gains[draft.now.job_id], draft.gains())
    done = {(draft.now.job_id, draft.now.stage) for draft in written if draft.is_newly(TaskStatus.DONE)}
    for job_id, count in task_sets.unblock(session, done).items():
        _add(gains[job_id], {TaskStatus.WAITING.value: -count, TaskStatus.READY.value: count})
    for job_id, count in late.items():
        _add(gains[job_id], {"late_events": count})
    add_to_counters(session, gains)
    publish_tasks(session, [(draft.read, draft.now) for draft in written])


def transition_tasks(
    session: Session, job_id: str, sequences: Iterable[int], was: TaskStatus, to: TaskStatus, **values: Any
) -> int:
    """Change the status of those tasks that are still `was`, and return their number."""
    check_transition(was, to)
    statement = update(Task).where(Task.job_id == job_id, Task.status == was).values(status=to, **values)
    count = sum(changed(session, statement.where(Task.sequence.in_(part))) for part in task_rows.parts(sequences))
    if count:
        add_to_counters(session, {job_id: {was.value: -count, to.value: count}})
    return count


def release_tasks(session: Session, row: Job, *, to: TaskStatus, now_s: float, only: TaskStatus | None = None) -> None:
    """Take the held tasks of a job (`only` those of one status) from their attempts, and request that these stop."""
    drafts = [TaskDraft(task) for task in task_sets.held(session, row.id, status=only)]
    for draft in drafts:
        draft.transition(to, progress=None, ended_s=now_s if to is TaskStatus.CANCELLED else None)
    coordinator_rows.request_stop(session, [draft.read.attempt for draft in drafts], now_s=now_s)
    write_drafts(session, drafts, now_s=now_s)
    session.refresh(row)


def _add(total: dict[str, float], gains: Mapping[str, float]) -> None:
    for name, gain in gains.items():
        total[name] = total.get(name, 0) + gain
