"""Pages of jobs: what is searched for, in which order, and how many jobs that is."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from sqlalchemy import ColumnElement, Double, case, cast, func, literal_column, or_, select
from sqlalchemy.orm import Session

from lippmann.job.states import JobStatus
from service.db.jobs import OPEN, is_seen_by
from service.db.tables import BackgroundJob, Job
from service.schemas.job import JobSort

_UNKNOWN_S = 1e300
"""The time left of a job without an estimate; in either direction it comes after all others."""


@dataclass(frozen=True)
class JobQuery:
    """The jobs that are asked for, and their order."""

    statuses: tuple[JobStatus, ...] = ()
    """Only jobs with one of these statuses; empty for all."""
    owner: str | None = None
    """Only jobs of the owner of this name or id."""
    search: str | None = None
    """Only jobs with this text in their title, scene, owner or id."""
    seen_by: str | None = None
    """Only jobs that this owner sees where jobs are hidden from others."""
    sort: JobSort = JobSort.CREATED
    ascending: bool = False


@dataclass(frozen=True)
class Position:
    """A job in a sorted list: the page after it is asked for."""

    job_id: str
    value: str | float
    """The value by which the list is sorted; the id where it is sorted by the time of submission."""


def page(session: Session, query: JobQuery, *, after: Position | None, offset: int, limit: int) -> list[Job]:
    """Return jobs in order, those after a position or after a number of other jobs."""
    value = _value(query)
    conditions = _conditions(query)
    if after is not None:
        conditions.append(_is_after(query, value, after))
    is_created = query.sort is JobSort.CREATED
    if is_created and not (offset or query.search or query.owner or query.seen_by):  # reads few rows beyond the page
        first = select(Job).where(*conditions).order_by(_ordered(query, Job.id.expression))
        return list(session.scalars(first.limit(limit)))
    # The specification of a job is long, so the ids are found and sorted without it: where they can, in the index
    # `ix_jobs_listed`, which has none. To get the ids in their own order, SQLite would read the rows.
    keys: list[ColumnElement[Any]] = [Job.id + literal_column("''")] if is_created else [value, Job.id.expression]
    order = [_ordered(query, key) for key in keys]
    ids = session.scalars(select(Job.id).where(*conditions).order_by(*order).offset(offset).limit(limit)).all()
    found = {row.id: row for row in session.scalars(select(Job).where(Job.id.in_(ids)))}
    return [found[job_id] for job_id in ids if job_id in found]


def count(session: Session, query: JobQuery) -> int:
    """Return the number of jobs that a query finds."""
    return int(session.scalar(select(func.count()).select_from(Job).where(*_conditions(query))) or 0)


def position_of(session: Session, query: JobQuery, row: Job) -> Position:
    """Return the position of a job in the list of a query."""
    if query.sort is JobSort.CREATED:
        return Position(row.id, row.id)
    value = session.scalar(select(_value(query)).where(Job.id == row.id))
    return Position(row.id, value if isinstance(value, str) else float(value or 0.0))


def _ordered(query: JobQuery, key: ColumnElement[Any]) -> ColumnElement[Any]:
    return key.asc() if query.ascending else key.desc()


def _conditions(query: JobQuery) -> list[ColumnElement[bool]]:
    conditions: list[ColumnElement[bool]] = [Job.background_job.is_distinct_from(BackgroundJob.REMOVE)]
    if len(query.statuses) == 1:
        conditions.append(Job.status == query.statuses[0])
    elif query.statuses:
        conditions.append(Job.status.in_(query.statuses))
    if query.owner is not None:
        conditions.append(or_(Job.owner == query.owner, Job.owner_id == query.owner))
    if query.search is not None:
        texts = (Job.title, Job.scene, Job.owner, Job.id)
        conditions.append(or_(*(column.icontains(query.search, autoescape=True) for column in texts)))
    if query.seen_by is not None:
        conditions.append(is_seen_by(query.seen_by))
    return conditions


def _is_after(query: JobQuery, value: ColumnElement[Any], after: Position) -> ColumnElement[bool]:
    is_later = Job.id > after.job_id if query.ascending else Job.id < after.job_id
    if query.sort is JobSort.CREATED:
        return is_later
    is_beyond = value > after.value if query.ascending else value < after.value
    return or_(is_beyond, (value == after.value) & is_later)


def _value(query: JobQuery) -> ColumnElement[Any]:
    if query.sort is JobSort.TIME_LEFT:
        return func.coalesce(_TIME_LEFT_S, _UNKNOWN_S if query.ascending else -1.0)
    return _VALUES[query.sort]


_MEASURED_PX = Job.done_px - Job.cached_px
_TIME_LEFT_S = case(
    (
        (Job.status == JobStatus.RUNNING) & (Job.running > 0) & (_MEASURED_PX > 0) & (Job.wall_s > 0),
        cast(Job.total_px - Job.done_px, Double) * Job.wall_s / cast(_MEASURED_PX, Double) / cast(Job.running, Double),
    ),
    else_=None,
)
"""The estimate of `service.events.payloads.eta_s`, without the progress of the running tasks."""
_PROGRESS = case(
    (Job.status == JobStatus.DONE, 1.0),
    (Job.total_px > 0, cast(Job.done_px, Double) / cast(Job.total_px, Double)),
    else_=0.0,
)
_VALUES: MappingProxyType[JobSort, ColumnElement[Any]] = MappingProxyType(
    {
        JobSort.CREATED: Job.id.expression,
        JobSort.NAME: func.lower(case((Job.title != "", Job.title), else_=Job.scene)),
        JobSort.OWNER: func.lower(Job.owner),
        JobSort.STATUS: case({status.value: float(rank) for rank, status in enumerate(JobStatus)}, value=Job.status),
        JobSort.PRIORITY: cast(Job.priority, Double),
        JobSort.WORK: cast(case((Job.status.in_(OPEN), -Job.priority), else_=1), Double),
        JobSort.FRAMES: cast(Job.frames_total, Double),
        JobSort.PROGRESS: _PROGRESS,
        JobSort.COST: Job.cpu_s.expression,
    }
)
IS_TEXT = frozenset({JobSort.CREATED, JobSort.NAME, JobSort.OWNER})
"""The orders whose values are texts; those of the others are numbers."""


def parse_position(cursor: str, sort: JobSort) -> Position | None:
    """Return the position in a cursor, None for a text that is not of this order; the inverse of `cursor_of`.

    >>> parse_position("01h~2.5", JobSort.COST)
    Position(job_id='01h', value=2.5)
    """
    job_id, mark, text = cursor.partition("~")
    if sort is JobSort.CREATED:
        return None if mark else Position(job_id, job_id)
    if not (mark and job_id):
        return None
    if sort in IS_TEXT:
        return Position(job_id, text)
    try:
        value = float(text)
    except ValueError:
        return None
    return Position(job_id, value) if math.isfinite(value) else None


def cursor_of(position: Position, sort: JobSort) -> str:
    """Return the cursor of a position.

    >>> cursor_of(Position("01h", 2.5), JobSort.COST)
    '01h~2.5'
    """
    return position.job_id if sort is JobSort.CREATED else f"{position.job_id}~{position.value}"
