"""Queries on the whole farm, for its figures: they read counters of jobs, never the tasks themselves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from sqlalchemy import bindparam, case, func, literal_column, or_, select
from sqlalchemy.orm import Session

from lippmann.job.rendering.workers import without_engine
from lippmann.job.states import HELD_TASKS, JobStatus, TaskStatus
from lippmann.plan.tasks import RENDERS_NOTHING
from service.db.jobs import OPEN, SCHEDULABLE
from service.db.tables import Job, OwnerUsage, Task, WebhookDelivery

TaskRow = tuple[JobStatus, int, int, int, int, int]
"""The status and the priority of open jobs, and the number of their waiting, ready, dispatched and running tasks."""
WantRow = tuple[str, int | None, str, int, int, int]
"""An owner, the limit of slots of a key, the requirement of tasks on their workers, and the number of ready, dispatched
and running tasks of these jobs. A task of
a job that is paused or has a background job is not ready, since it takes no slot, and neither are those beyond the own
limit of their job."""

_TASKS = (
    select(
        Job.status, Job.priority,
        func.sum(Job.waiting), func.sum(Job.ready), func.sum(Job.dispatched), func.sum(Job.running),
    )
    .where(Job.status.in_(OPEN))
    .group_by(Job.status, Job.priority)
)  # fmt: skip
_IS_FREE = Job.background_job.is_(None)
_LEFT = Job.own_slots - Job.dispatched - Job.running
_ALLOWED = case((or_(Job.own_slots.is_(None), Job.ready <= _LEFT), Job.ready), (_LEFT > 0, _LEFT), else_=0)
"""The ready tasks of a job that its own limit of slots lets run now."""
_WANTED = (
    select(
        Job.owner_id, Job.max_slots, Job.requirement, Job.status, _IS_FREE,
        func.sum(_ALLOWED), func.sum(Job.dispatched), func.sum(Job.running),
    )
    .where(Job.status.in_(OPEN))
    .group_by(Job.owner_id, Job.max_slots, Job.requirement, Job.status, _IS_FREE)
)  # fmt: skip
_WITHOUT_ENGINE = (
    select(
        Job.owner_id, Job.max_slots, Job.requirement, Job.status, _IS_FREE,
        *(
            func.sum(case((Task.status == status, 1), else_=0))
            for status in (TaskStatus.READY, TaskStatus.DISPATCHED, TaskStatus.RUNNING)
        ),
    )
    .join(Task, Task.job_id == Job.id)
    .where(Job.status.in_(OPEN), Job.requirement.in_(bindparam("requirements", expanding=True)))
    .where(Task.stage.in_(RENDERS_NOTHING), Task.status.in_((TaskStatus.READY, *HELD_TASKS)))
    .group_by(Job.owner_id, Job.max_slots, Job.requirement, Job.status, _IS_FREE)
)  # fmt: skip
_JOBS = (
    select(Job.status, func.count()).where(Job.status.in_(bindparam("statuses", expanding=True))).group_by(Job.status)
)
_OLDEST_QUEUED = select(func.min(Job.created_s)).where(Job.status == JobStatus.QUEUED)
_ARTIFACT_BYTES = select(func.coalesce(func.sum(OwnerUsage.artifact_bytes), 0))
_IS_RETRIED = WebhookDelivery.attempts > literal_column("0")
_WEBHOOKS = select(_IS_RETRIED, func.count()).group_by(_IS_RETRIED)


def tasks(session: Session) -> Sequence[TaskRow]:
    """Count the tasks of open jobs by the status and the priority of their jobs."""
    return [
        (status, int(priority), int(waiting), int(ready), int(dispatched), int(running))
        for status, priority, waiting, ready, dispatched, running in session.execute(_TASKS)
    ]


def wanted(session: Session) -> Sequence[WantRow]:
    """Count the tasks that have a slot or would take one now, by owner, limit and requirement, in one or more rows.

    The requirement is that of the tasks: those that render nothing have rows of their own, where theirs is another.
    """
    found = session.execute(_WANTED).all()
    mixed = sorted({row[2] for row in found if without_engine(row[2]) != row[2]})
    others = session.execute(_WITHOUT_ENGINE, {"requirements": mixed}).all() if mixed else ()
    apart = {tuple(row[:5]): row[5:] for row in others}
    rows: list[WantRow] = []
    for owner, limit, asks, status, is_free, ready, dispatched, running in found:
        counts = (int(ready) if is_free and status in SCHEDULABLE else 0, int(dispatched), int(running))
        own = apart.get((owner, limit, asks, status, is_free), (0, 0, 0))
        part = [min(count, int(other)) for count, other in zip(counts, own, strict=True)]
        if any(part):
            rows.append((owner, limit, without_engine(asks), part[0], part[1], part[2]))
        rows.append((owner, limit, asks, counts[0] - part[0], counts[1] - part[1], counts[2] - part[2]))
    return rows


def jobs(session: Session, statuses: Iterable[JobStatus]) -> dict[JobStatus, int]:
    """Count the jobs of some statuses; one without jobs is left out. Those that have ended may be very many."""
    return dict(session.execute(_JOBS, {"statuses": [*statuses]}).all())


def oldest_queued_s(session: Session) -> float | None:
    """Return when the oldest job was submitted of which nothing has begun; None if there is no such job."""
    return session.scalar(_OLDEST_QUEUED)


def artifact_bytes(session: Session) -> int:
    """Return the bytes of the artifacts of all owners."""
    return int(session.scalar(_ARTIFACT_BYTES) or 0)


def webhooks(session: Session) -> tuple[int, int]:
    """Return the number of webhook messages that were not tried yet, and of those that are tried again."""
    found = {bool(retried): int(count) for retried, count in session.execute(_WEBHOOKS)}
    return found.get(False, 0), found.get(True, 0)
