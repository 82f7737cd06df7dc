"""Queries on jobs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from sqlalchemy import ColumnElement, bindparam, func, literal_column, or_, select, update
from sqlalchemy.orm import Session

from lippmann.job.messages.orders import TaskKind, requirement_of
from lippmann.job.rendering.workers import without_engine
from lippmann.job.states import HELD_TASKS, JobStatus, PausedBy, TaskStatus
from lippmann.plan.tasks import RENDERS_NOTHING
from service.db.engine import changed
from service.db.tables import BackgroundJob, Job, Task
from service.errors import StorageQuotaExceeded

SCHEDULABLE = (JobStatus.QUEUED, JobStatus.PROBING, JobStatus.RUNNING)
"""The statuses in which the tasks of a job may be dispatched."""
OPEN = (*SCHEDULABLE, JobStatus.PAUSED)
"""The statuses of jobs that have not ended."""
WORKABLE = (JobStatus.PROBING, JobStatus.RUNNING)
"""The statuses of jobs whose work has begun and goes on."""
BEGUN = (*WORKABLE, JobStatus.PAUSED)
"""The statuses of jobs that have begun and not ended."""

MOST_REQUIREMENTS = 500
"""The largest number of different requirements of open jobs that have queues; jobs with further ones wait for them."""
HAS_REQUIREMENT = Job.requirement != literal_column("''")
"""The condition that a job asks something of its workers, as the index `ix_jobs_requirement` has it."""
IS_BUSY = Job.dispatched + Job.running > literal_column("0")
"""The condition that a job has outstanding orders, as the index `ix_jobs_busy` has it."""


def _due_task() -> ColumnElement[Any]:
    task = select(Task.sequence).where(Task.job_id == Job.id, Task.status == TaskStatus.READY)
    due = task.where(or_(Task.not_before_s.is_(None), Task.not_before_s <= bindparam("now_s")))
    return due.correlate(Job).limit(1).scalar_subquery()


IS_DISPATCHABLE = (
    Job.status.in_(SCHEDULABLE),
    Job.ready > 0,
    Job.background_job.is_(None),
    or_(Job.own_slots.is_(None), Job.dispatched + Job.running < Job.own_slots),
    _due_task().is_not(None),  # not EXISTS, for the reason given in `service.db.tasks.is_blocked`
)
"""The conditions that some task of a job may be dispatched at the time of the parameter `now_s`."""
CLAIM = (
    Job.id, Job.priority, (Job.dispatched + Job.running).label("outstanding"), Job.ready, Job.owner_id, Job.max_slots,
    Job.requirement, Job.own_slots,
)  # fmt: skip
"""The columns of a job that wants slots: id, priority, outstanding orders, ready tasks, owner, limit of its key, what
it asks of its workers, and its own limit."""
ClaimRow = tuple[str, int, int, int, str, int | None, str, int | None]
"""The values of `CLAIM`."""

# Statements that every round executes are made once.
_JOBS = (
    select(Job)
    .where(Job.id.in_(bindparam("job_ids", expanding=True)))
    .where(Job.background_job.is_distinct_from(BackgroundJob.REMOVE))
    .order_by(Job.id)
    .execution_options(populate_existing=True)
)
_BUSY = select(Job.id).where(IS_BUSY, Job.status.in_(OPEN)).order_by(Job.id)
_RUNNING_ON = (
    select(Job.requirement, Task.kind, func.count())
    .join(Task, Task.job_id == Job.id)
    .where(IS_BUSY, Job.status.in_(OPEN))
    .where(Task.status == TaskStatus.RUNNING, Task.worker.in_(bindparam("workers", expanding=True)))
    .group_by(Job.requirement, Task.kind)
)
_REQUIREMENTS_OF = select(Job.id, Job.requirement).where(Job.id.in_(bindparam("job_ids", expanding=True)))
_BACKGROUND_JOBS = (
    select(Job.id, Job.background_job)
    .where(Job.background_job.in_(bindparam("kinds", expanding=True)))
    .order_by(Job.id)
)
_PAUSED_BY_FARM = (
    select(Job.id, Job.pause_reason)
    .where(Job.status == JobStatus.PAUSED, Job.paused_by == PausedBy.FARM)
    .where(Job.pause_code.is_distinct_from(StorageQuotaExceeded.code))
    .order_by(Job.id)
)
_FIRST_CLAIM = (
    select(Job.id).where(*IS_DISPATCHABLE, Job.requirement.in_(bindparam("requirements", expanding=True))).limit(1)
)
_CLAIMS = select(*CLAIM).where(*IS_DISPATCHABLE).order_by(Job.id)
_OUTSTANDING = (
    select(Job.owner_id, Job.requirement, func.sum(Job.dispatched + Job.running))
    .where(IS_BUSY, Job.status.in_(OPEN))
    .group_by(Job.owner_id, Job.requirement)
)
_WITHOUT_ENGINE = (
    select(Job.owner_id, Job.requirement, func.count())
    .join(Task, Task.job_id == Job.id)
    .where(IS_BUSY, Job.status.in_(OPEN), Job.requirement.in_(bindparam("requirements", expanding=True)))
    .where(Task.status.in_(HELD_TASKS), Task.stage.in_(RENDERS_NOTHING))
    .group_by(Job.owner_id, Job.requirement)
)
_REQUIREMENTS = (
    select(Job.requirement)
    .where(HAS_REQUIREMENT, Job.status.in_(OPEN))
    .group_by(Job.requirement)
    .order_by(func.min(Job.id))
    .limit(MOST_REQUIREMENTS)
)
_BUSY_REQUIREMENTS = select(Job.id, Job.requirement).where(IS_BUSY, Job.status.in_(OPEN))


def job(session: Session, job_id: str) -> Job | None:
    """Return a job as it is in the database now, unless it is being removed."""
    found = session.get(Job, job_id, populate_existing=True)
    return None if found is None or found.background_job is BackgroundJob.REMOVE else found


def jobs(session: Session, job_ids: Iterable[str]) -> Sequence[Job]:
    """Return those jobs that exist and are not being removed, as they are in the database now, sorted by id."""
    return session.scalars(_JOBS, {"job_ids": [*job_ids]}).all()


def owner_of(session: Session, job_id: str) -> tuple[str, bool] | None:
    """Return the owner of a job, and whether it is shared; None if the job does not exist or is being removed."""
    query = select(Job.owner_id, Job.shared)
    query = query.where(Job.id == job_id, Job.background_job.is_distinct_from(BackgroundJob.REMOVE))
    row = session.execute(query).first()
    return None if row is None else (row[0], row[1])


def is_seen_by(owner_id: str) -> ColumnElement[bool]:
    """Return the condition that an owner sees a job where jobs are hidden from others."""
    return or_(Job.owner_id == owner_id, Job.shared.is_(True))


def open_of(session: Session, owner_id: str) -> tuple[int, int]:
    """Return the number of open jobs of an owner, and of their frames."""
    query = select(func.count(), func.coalesce(func.sum(Job.frames_total), 0))
    jobs, frames = session.execute(query.where(Job.owner_id == owner_id, Job.status.in_(OPEN))).one()
    return int(jobs), int(frames)


def statuses(session: Session, job_ids: Iterable[str]) -> Sequence[tuple[str, JobStatus]]:
    """Return the statuses of jobs, sorted by id."""
    return session.execute(select(Job.id, Job.status).where(Job.id.in_([*job_ids])).order_by(Job.id)).all()


def set_probes(session: Session, probes: Mapping[str, dict[str, Any]]) -> None:
    """Store the measurements of probes, by job, and leave the planning to a background job.

    The notes of a probe are added to those of its job.
    """
    if not probes:
        return
    statement = update(Job).where(Job.id == bindparam("of_job"))
    statement = statement.values(probe=bindparam("measured"), background_job=BackgroundJob.PLAN)
    rows = [{"of_job": job_id, "measured": measured} for job_id, measured in probes.items()]
    session.connection().execute(statement, rows)
    for row in jobs(session, [job_id for job_id, measured in probes.items() if measured["notes"]]):
        row.notes = list(dict.fromkeys((*row.notes, *probes[row.id]["notes"])))


def without_bundle(session: Session, *, limit: int) -> Sequence[str]:
    """Return jobs of an earlier release whose scene bundles are not known yet."""
    return session.scalars(select(Job.id).where(Job.bundle.is_(None)).order_by(Job.id).limit(limit)).all()


def set_bundles(session: Session, bundles: Mapping[str, str]) -> None:
    """Store the digests of the scene bundles of jobs, by job."""
    statement = update(Job).where(Job.id == bindparam("of_job")).values(bundle=bindparam("digest"))
    if bundles:
        rows = [{"of_job": job_id, "digest": digest} for job_id, digest in bundles.items()]
        session.connection().execute(statement, rows)


def has_row(session: Session, job_id: str) -> bool:
    """Return whether a job has a row; a job that is being removed still has one."""
    return session.execute(select(Job.id).where(Job.id == job_id)).first() is not None


def can_dispatch(session: Session, requirements: Iterable[str] = ("",), *, now_s: float) -> bool:
    """Return whether some task of a job with one of some requirements may be dispatched now."""
    parameters = {"now_s": now_s, "requirements": [*requirements]}
    return session.execute(_FIRST_CLAIM, parameters).first() is not None


def claims(session: Session, *, now_s: float) -> Sequence[ClaimRow]:
    """Return the jobs whose tasks may be dispatched now, by the columns of `CLAIM`."""
    return session.execute(_CLAIMS, {"now_s": now_s}).all()


def outstanding(session: Session) -> dict[tuple[str, str], int]:
    """Return the number of outstanding orders, by the owner of their jobs and the requirement of their tasks."""
    found = {(owner_id, requirement): int(count) for owner_id, requirement, count in session.execute(_OUTSTANDING)}
    for owner_id, requirement, count in outstanding_without_engine(session, {asked for _, asked in found}):
        others = owner_id, without_engine(requirement)
        found[owner_id, requirement] -= count
        found[others] = found.get(others, 0) + count
    return found


def outstanding_without_engine(session: Session, requirements: Iterable[str]) -> Sequence[tuple[str, str, int]]:
    """Return the number of outstanding orders that render nothing, by owner and requirement of their jobs.

    Parameters
    ----------
    requirements
        The requirements of the jobs. Those whose tasks all have one requirement are left out.
    """
    mixed = sorted(asked for asked in requirements if without_engine(asked) != asked)
    return session.execute(_WITHOUT_ENGINE, {"requirements": mixed}).all() if mixed else ()


def running_on(session: Session, workers: Sequence[str]) -> dict[str, int]:
    """Return the number of tasks that run on some workers, by the requirement of the tasks."""
    rows = session.execute(_RUNNING_ON, {"workers": list(workers)}) if workers else ()
    found: dict[str, int] = {}
    for requirement, kind, count in rows:
        asked = requirement_of(requirement, TaskKind(kind))
        found[asked] = found.get(asked, 0) + int(count)
    return found


def requirements_of(session: Session, job_ids: Iterable[str]) -> dict[str, str]:
    """Return the requirements of some jobs, by job."""
    ids = list(job_ids)
    rows = session.execute(_REQUIREMENTS_OF, {"job_ids": ids}) if ids else ()
    return {row[0]: row[1] for row in rows}


def requirements(session: Session) -> Sequence[str]:
    """Return the different requirements of tasks of the open jobs that have one, sorted: those of the oldest jobs."""
    found = set(session.scalars(_REQUIREMENTS))
    return sorted(found | {without_engine(asked) for asked in found})


def requirements_of_busy(session: Session) -> dict[str, str]:
    """Return the requirements of the jobs with outstanding orders that have one, by job."""
    return {job_id: requirement for job_id, requirement in session.execute(_BUSY_REQUIREMENTS) if requirement}


def busy_ids(session: Session) -> Sequence[str]:
    """Return the jobs with outstanding orders; there are few, because the queue is shallow."""
    return session.scalars(_BUSY).all()


def to_reconcile(session: Session, *, after: str, limit: int) -> Sequence[str]:
    """Return jobs whose rows may need repair: tasks wait or have failed, or no task is left."""
    left = Job.waiting + Job.ready + Job.dispatched + Job.running + Job.cancelled
    is_over = Job.planned_s.is_not(None) & (left == 0)
    query = select(Job.id).where(Job.status.in_(OPEN), Job.background_job.is_(None), Job.id > after)
    query = query.where(or_(Job.waiting > 0, Job.failed > 0, is_over))
    return session.scalars(query.order_by(Job.id).limit(limit)).all()


def workable_ids(session: Session) -> Sequence[str]:
    """Return the jobs whose work has begun and goes on."""
    query = select(Job.id).where(Job.status.in_(WORKABLE))
    return session.scalars(query.order_by(Job.id)).all()


def paused_by_farm(session: Session) -> dict[str, str | None]:
    """Return the reasons of the jobs that a fault has paused, by job; those beyond a quota are not among them."""
    return dict(session.execute(_PAUSED_BY_FARM).all())


def open_ids(session: Session) -> Sequence[str]:
    """Return the jobs that have not ended."""
    return session.scalars(select(Job.id).where(Job.status.in_(OPEN)).order_by(Job.id)).all()


def background_jobs(session: Session, kinds: Iterable[BackgroundJob]) -> Sequence[tuple[str, BackgroundJob]]:
    """Return the jobs that have a background job of some kinds, and which one."""
    rows = session.execute(_BACKGROUND_JOBS, {"kinds": [*kinds]})
    return [(job_id, kind) for job_id, kind in rows if kind is not None]


def request_repairs(session: Session, job_ids: Iterable[str]) -> None:
    """Give jobs without a background job the one that repairs their artifacts."""
    wanted = sorted(job_ids)
    if wanted:
        statement = update(Job).where(Job.id.in_(wanted), Job.background_job.is_(None))
        changed(session, statement.values(background_job=BackgroundJob.REPAIR))
