"""Queries on tasks. Each of them is restricted to jobs, and each that may return many rows has a limit."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import fields
from itertools import islice
from typing import Any, TypeVar

from sqlalchemy import ColumnElement, Select, Update, and_, bindparam, func, or_, select, update
from sqlalchemy.orm import Session, aliased, undefer

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.states import HELD_TASKS, SATISFIED_TASKS, JobStatus, PausedBy, TaskStatus
from service.db.engine import changed
from service.db.jobs import BEGUN, WORKABLE
from service.db.tables import Job, Task, WorkerFault
from service.db.task_state import HeldAttempt
from service.errors import StorageQuotaExceeded

Value = TypeVar("Value")

CHUNK = 1000
"""The largest number of rows that one transaction changes."""
VALUES_AT_ONCE = 10_000
"""The largest number of values in one condition. PostgreSQL takes at most 65,535 parameters in a statement."""
FRAMES_A_PAGE = 100
"""Frames that artifact repair examines together."""
# Statements that every round executes are made once.
_HELD = select(*(getattr(Task, field.name) for field in fields(HeldAttempt))).where(
    Task.job_id.in_(bindparam("job_ids", expanding=True)), Task.status.in_(HELD_TASKS)
)
_RENDERS = select(Task.sequence, Task.frame, Task.status, Task.digests).where(
    Task.job_id == bindparam("job_id"),
    Task.frame.in_(bindparam("frames", expanding=True)),
    Task.kind == TaskKind.RENDER,
)
_RUNNING_PX = (
    select(Task.job_id, func.sum(Task.weight_px * func.coalesce(Task.progress, 0.0)))
    .where(Task.job_id.in_(bindparam("job_ids", expanding=True)), Task.status == TaskStatus.RUNNING)
    .group_by(Task.job_id)
)
UNSATISFIED = tuple(status for status in TaskStatus if status not in SATISFIED_TASKS)


def task(session: Session, job_id: str, sequence: int) -> Task | None:
    """Return a task as it is in the database now."""
    return session.get(Task, (job_id, sequence), populate_existing=True)


def page(
    session: Session,
    job_id: str,
    *,
    status: TaskStatus | None,
    kind: TaskKind | None,
    frame: int | None = None,
    after: int,
    limit: int,
) -> Sequence[Task]:
    """Return the tasks of a job after a sequence number, in order."""
    # A sum, so that for the few tasks of a frame PostgreSQL does not walk over the job in this order.
    place = Task.sequence if frame is None else Task.sequence + 0
    query = select(Task).where(Task.job_id == job_id, place > after)
    if frame is not None:
        query = query.where(Task.frame == frame)
    if status is not None:
        query = query.where(Task.status == status)
    if kind is not None:
        query = query.where(Task.kind == kind)
    return session.scalars(query.order_by(place).limit(limit)).all()


def held(session: Session, job_ids: Iterable[str]) -> list[HeldAttempt]:
    """Return the attempts that own a task of some jobs; there are few, because the queue is shallow."""
    busy = list(job_ids)
    rows = session.execute(_HELD, {"job_ids": busy}) if busy else ()
    # To get this order from the database, SQLite would read all tasks of the jobs.
    return sorted((HeldAttempt(*row) for row in rows), key=lambda held: (held.job_id, held.sequence))


def in_statuses(session: Session, job_id: str, statuses: Iterable[TaskStatus]) -> Sequence[tuple[int, TaskStatus]]:
    """Return one chunk of the tasks that have one of `statuses`."""
    query = select(Task.sequence, Task.status).where(Task.job_id == job_id, Task.status.in_(list(statuses)))
    return session.execute(query.limit(CHUNK)).all()


def retriable(session: Session, job_id: str) -> Sequence[tuple[int, TaskStatus, bool]]:
    """Return one chunk of failed and cancelled tasks: (sequence, status, whether the needed stage is not done)."""
    query = select(Task.sequence, Task.status, is_blocked().label("blocked")).where(
        Task.job_id == job_id, Task.status.in_([TaskStatus.FAILED, TaskStatus.CANCELLED])
    )
    return session.execute(query.limit(CHUNK)).all()


def overdue(session: Session, job_id: str, *, after: int) -> tuple[list[int], int | None]:
    """Find the waiting tasks of one chunk whose needs are done; return them and the next position, None at the end."""
    query = select(Task.sequence, is_blocked()).where(
        Task.job_id == job_id, Task.status == TaskStatus.WAITING, Task.sequence > after
    )
    rows = session.execute(query.order_by(Task.sequence).limit(CHUNK)).all()
    free = [sequence for sequence, blocked in rows if not blocked]
    return free, rows[-1][0] if len(rows) == CHUNK else None


def last_sequence(session: Session, job_id: str) -> int:
    """Return the highest sequence number of a job's tasks."""
    return int(session.scalar(select(func.max(Task.sequence)).where(Task.job_id == job_id)) or 0)


def permanent_failure(session: Session, job_id: str) -> Task | None:
    """Return a task that failed permanently and that other tasks need; no task needs an output."""
    query = select(Task).where(Task.job_id == job_id, Task.status == TaskStatus.FAILED, Task.permanent.is_(True))
    query = query.where(Task.kind != TaskKind.ENCODE)
    return session.scalars(query.order_by(Task.sequence).limit(1)).first()


def first_failure(session: Session, job_id: str) -> Task | None:
    """Return the first task that failed."""
    query = select(Task).where(Task.job_id == job_id, Task.status == TaskStatus.FAILED)
    return session.scalars(query.order_by(Task.sequence).limit(1)).first()


def failed_outputs(session: Session, job_id: str) -> int:
    """Return the number of outputs of a job that failed."""
    query = select(func.count()).where(
        Task.job_id == job_id, Task.stage == TaskKind.ENCODE.value, Task.status == TaskStatus.FAILED
    )
    return int(session.scalar(query) or 0)


def done_outputs(session: Session, job_ids: Iterable[str]) -> set[tuple[str, str]]:
    """Return the outputs that are done, as pairs (job, output)."""
    query = select(Task.job_id, Task.output).where(
        Task.job_id.in_(list(job_ids)), Task.stage == TaskKind.ENCODE.value, Task.status == TaskStatus.DONE
    )
    return {(job_id, output or "") for job_id, output in session.execute(query)}


def running_px(session: Session, job_ids: Iterable[str]) -> dict[str, float]:
    """Return the pixels that running attempts have finished by their reported progress, by job."""
    rows = session.execute(_RUNNING_PX, {"job_ids": list(job_ids)})
    return {job_id: float(px or 0.0) for job_id, px in rows}


def running_on(session: Session, job_ids: Iterable[str]) -> dict[str, int]:
    """Return the number of running tasks, by worker."""
    query = (
        select(Task.worker, func.count())
        .where(Task.job_id.in_(list(job_ids)), Task.status == TaskStatus.RUNNING)
        .group_by(Task.worker)
    )
    return {worker or "": n for worker, n in session.execute(query)}


def frames(
    session: Session, job_id: str, numbers: Sequence[int]
) -> Sequence[tuple[int | None, TaskKind, TaskStatus, int]]:
    """Count the tasks of some frames: (frame, kind, status, number of tasks)."""
    query = (
        select(Task.frame, Task.kind, Task.status, func.count())
        .where(Task.job_id == job_id, Task.frame.in_(numbers))
        .group_by(Task.frame, Task.kind, Task.status)
    )
    return session.execute(query).all()


def parts(values: Iterable[Value]) -> Iterator[list[Value]]:
    """Divide any number of values into parts that a condition takes."""
    rest = iter(values)
    while part := list(islice(rest, VALUES_AT_ONCE)):
        yield part


def of_frames(session: Session, job_id: str, frames: Collection[int]) -> Sequence[Task]:
    """Return the tasks of some frames, in order."""
    query = _fresh(select(Task).where(Task.job_id == job_id))
    found = [task for part in parts(frames) for task in session.scalars(query.where(Task.frame.in_(part)))]
    return sorted(found, key=lambda task: task.sequence)


def failed_frames(session: Session, job_id: str) -> Sequence[int]:
    """Return the frames with a task that failed."""
    query = select(Task.frame).where(Task.job_id == job_id, Task.status == TaskStatus.FAILED)
    return [frame for frame in session.scalars(query.distinct()) if frame is not None]


def skipped_frames(session: Session, job_ids: Iterable[str]) -> dict[str, tuple[int, ...]]:
    """Return the skipped frames of those jobs that have some, in order."""
    wanted, found = list(job_ids), dict[str, tuple[int, ...]]()
    if not wanted:
        return found
    query = select(Task.job_id, Task.frame).where(Task.job_id.in_(wanted), Task.status == TaskStatus.SKIPPED)
    for job_id, frame in session.execute(query.where(Task.kind == TaskKind.ASSEMBLE).order_by(Task.sequence)):
        if frame is not None:
            found[job_id] = (*found.get(job_id, ()), frame)
    return found


def outputs(session: Session, job_id: str) -> Sequence[Task]:
    """Return the tasks that make the outputs of a job, with their digests."""
    query = select(Task).where(Task.job_id == job_id, Task.stage == TaskKind.ENCODE.value)
    return session.scalars(_with_digests(query.order_by(Task.sequence))).all()


def prevented_workers(session: Session, *, now_s: float) -> Sequence[WorkerFault]:
    """Return the workers that jobs avoid now because something other than the task prevented the work there.

    Jobs that a user paused, and jobs beyond a quota, are not among them.
    """
    is_of_fault = Job.pause_code.is_distinct_from(StorageQuotaExceeded.code)
    by_fault = and_(Job.status == JobStatus.PAUSED, Job.paused_by == PausedBy.FARM, is_of_fault)
    may_work = or_(Job.status.in_(WORKABLE), by_fault)
    is_open = select(Job.id).where(Job.id == WorkerFault.job_id, may_work).exists()
    query = select(WorkerFault).where(WorkerFault.code.is_not(None), WorkerFault.avoided_until_s > now_s, is_open)
    return session.scalars(query.order_by(WorkerFault.job_id, WorkerFault.worker)).all()


def end_pauses(session: Session, *, latest_s: float) -> int:
    """Let those ready tasks be dispatched at once that would wait until after a time, and return their number."""
    return changed(session, _paused_until_after(latest_s).values(not_before_s=None))


def shorten_pauses(session: Session, *, by_s: float, now_s: float) -> int:
    """Let the ready tasks that wait now be dispatched so much earlier, and return their number."""
    return changed(session, _paused_until_after(now_s).values(not_before_s=Task.not_before_s - by_s))


def _paused_until_after(time_s: float) -> Update:
    at_work = select(Job.id).where(Job.status.in_(BEGUN))
    return update(Task).where(Task.job_id.in_(at_work), Task.status == TaskStatus.READY, Task.not_before_s > time_s)


def unreadable(session: Session, job_id: str, codes: Collection[str], *, after: int) -> Sequence[Task]:
    """Return one page of the failed and cancelled tasks whose last error has one of `codes`."""
    return _with_error(session, job_id, (TaskStatus.FAILED, TaskStatus.CANCELLED), codes, after=after)


def waiting_for_repair(session: Session, job_id: str, codes: Collection[str]) -> Sequence[Task]:
    """Return one page of the waiting tasks whose last error has one of `codes`."""
    return _with_error(session, job_id, (TaskStatus.WAITING,), codes, after=-1)


def _with_error(
    session: Session, job_id: str, statuses: Sequence[TaskStatus], codes: Collection[str], *, after: int
) -> Sequence[Task]:
    query = (
        select(Task)
        .where(Task.job_id == job_id, Task.status.in_(statuses))
        .where(Task.error_code.in_(codes), Task.sequence > after)
    )
    return session.scalars(_fresh(query.order_by(Task.sequence).limit(FRAMES_A_PAGE))).all()


def done_assemblies(session: Session, job_id: str, *, after: int) -> Sequence[Task]:
    """Return one page of the assembly tasks that are done, with their digests."""
    query = select(Task).where(Task.job_id == job_id, Task.status == TaskStatus.DONE)
    query = query.where(Task.kind == TaskKind.ASSEMBLE, Task.sequence > after)
    return session.scalars(_with_digests(query.order_by(Task.sequence).limit(FRAMES_A_PAGE))).all()


def made_by(
    session: Session, job_id: str, kind: TaskKind, *, frame: int | None, tile: TileIndex | None, output: str | None
) -> Task | None:
    """Return the task of a kind for a frame, a tile of it, or an output, with its digests."""
    query = select(Task).where(Task.job_id == job_id, Task.kind == kind)
    # Few tasks have no frame: the probe and the outputs.
    query = query.where(Task.frame == frame) if frame is not None else query.where(Task.frame.is_(None))
    if tile is not None:
        query = query.where(Task.tile_row == tile.row, Task.tile_col == tile.col)
    if output is not None:
        query = query.where(Task.output == output)
    return session.scalars(_with_digests(query.limit(1))).first()


def done_page(session: Session, job_id: str, *, after: int) -> Sequence[Task]:
    """Return one page of the tasks that are done, with their digests."""
    query = select(Task).where(Task.job_id == job_id, Task.status == TaskStatus.DONE, Task.sequence > after)
    return session.scalars(_with_digests(query.order_by(Task.sequence).limit(FRAMES_A_PAGE))).all()


def digests_of_assemblies(session: Session, job_id: str) -> Iterator[dict[str, Any]]:
    """Yield the digests of the done assembly tasks of a job that reported some."""
    query = select(Task.digests).where(Task.job_id == job_id, Task.status == TaskStatus.DONE)
    query = query.where(Task.kind == TaskKind.ASSEMBLE)
    yield from filter(None, session.scalars(query.order_by(Task.sequence).execution_options(yield_per=CHUNK)))


def done_renders(session: Session, job_id: str, frames: Iterable[int | None]) -> Sequence[Task]:
    """Return the render tasks of some frames that are done, with their digests."""
    query = _with_digests(select(Task).where(Task.job_id == job_id, Task.kind == TaskKind.RENDER))
    # With the status or the order in the query, PostgreSQL reads all tasks of the job that are done, or all of them.
    found = [task for part in parts(frames) for task in session.scalars(query.where(Task.frame.in_(part)))]
    return sorted((task for task in found if task.status is TaskStatus.DONE), key=lambda task: task.sequence)


def render_digests(
    session: Session, job_id: str, frames: Iterable[int | None]
) -> list[tuple[int | None, dict[str, Any] | None]]:
    """Return the digests of the done render tasks of some frames, as pairs (frame, digests), in the order of tasks."""
    rows = session.execute(_RENDERS, {"job_id": job_id, "frames": [*frames]})
    # With the status or the order in the query, PostgreSQL reads all tasks of the job that are done, or all of them.
    done = sorted((row.sequence, row.frame, row.digests) for row in rows if row.status is TaskStatus.DONE)
    return [(frame, digests) for _, frame, digests in done]


def numbered(session: Session, job_id: str, sequences: Iterable[int], *, status: TaskStatus) -> Sequence[Task]:
    """Return the tasks with some sequence numbers that have a status."""
    query = _fresh(select(Task).where(Task.job_id == job_id, Task.status == status))
    found = [task for part in parts(sequences) for task in session.scalars(query.where(Task.sequence.in_(part)))]
    return sorted(found, key=lambda task: task.sequence)


def done_among(session: Session, job_id: str, sequences: Iterable[int]) -> Sequence[Task]:
    """Return those of some tasks that are done, with their digests."""
    query = select(Task).where(Task.job_id == job_id, Task.sequence.in_([*sequences]), Task.status == TaskStatus.DONE)
    return session.scalars(_with_digests(query.order_by(Task.sequence))).all()


def is_waiting_rightly(session: Session, job_id: str, sequence: int) -> bool:
    """Return whether the stage that a task needs is not done."""
    query = select(Task.sequence).where(Task.job_id == job_id, Task.sequence == sequence, is_blocked())
    return session.execute(query).first() is not None


def blocked(session: Session, job_id: str, stages: Iterable[str], sequences: Iterable[int]) -> Sequence[int]:
    """Return the ready tasks whose needed stage is not done: those that need one of `stages`, and of `sequences`."""
    query = select(Task.sequence).where(Task.job_id == job_id, Task.status == TaskStatus.READY, is_blocked())
    query = query.where(or_(Task.needs.in_([*stages]), Task.sequence.in_([*sequences])))
    return session.scalars(query.order_by(Task.sequence)).all()


def is_blocked() -> ColumnElement[bool]:
    """Return the condition that a task of the stage that a task needs is not done."""
    other = aliased(Task)
    needed = select(other.sequence).where(
        other.job_id == Task.job_id, other.stage == Task.needs, other.status.in_(UNSATISFIED)
    )
    # PostgreSQL answers EXISTS for many tasks by reading the whole table once; this it answers by the index.
    return needed.correlate(Task).limit(1).scalar_subquery().is_not(None)


def _with_digests(query: Select[Task]) -> Select[Task]:
    return _fresh(query.options(undefer(Task.digests)))


def _fresh(query: Select[Task]) -> Select[Task]:
    return query.execution_options(populate_existing=True)
