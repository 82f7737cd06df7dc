"""Events become rows: once each, and only while their attempt still owns its task.

The position in the stream moves in the same transaction as the rows, so an event counts once however often it is read.
An event that cannot be written down is said, counted as late and passed over: the stream never stands still for one.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import structlog
from sqlalchemy import update
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from lippmann.job.events import Event, EventKind, Failure
from lippmann.job.orders import TaskKind
from lippmann.job.states import HELD_TASKS, TaskStatus
from service.broker_stream import Entry
from service.coordinator.retry_policy import fail_attempt
from service.db import coordinator as clerk_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.counters import move_task, shift
from service.db.engine import Database, changed
from service.db.tables import Chore, Job, Task
from service.errors import NotFound
from service.events.publish import tell_progress, tell_task
from service.ids import parse_task_id
from service.jobs.completion import settle
from service.jobs.state_machine import set_job
from service.jobs.unblock import unblock
from service.settings import Settings

NO_PROBE = Failure(code="probe-empty", message="the probe ended without a measurement", permanent=False)
NO_REASON = Failure(code="unknown", message="the worker gave no reason", permanent=False)

_AFTER = {
    EventKind.FAILED: (TaskStatus.READY, TaskStatus.FAILED),
    EventKind.DECLINED: (TaskStatus.READY,),
}
"""Where a task stands after an event: what finds it there, from the same attempt, has been said before."""
_AT_WORK = frozenset({EventKind.CLAIMED, EventKind.BEAT})
"""What an attempt says while it works."""

log = structlog.get_logger("service.follow")


@dataclass
class Batch:
    """What one transaction does: when, by which rules, and which jobs it touches."""

    session: Session
    now_s: float
    settings: Settings
    touched: set[str] = field(default_factory=set)


def follow(database: Database, entries: Sequence[Entry], *, was: str, now_s: float, settings: Settings) -> bool:
    """Write down a piece of the stream that begins after `was`; False if another clerk did."""
    events = _without_old_beats(event for _, event in entries if event is not None)
    try:
        with database.writing() as session:
            if not clerk_rows.advance(session, was, entries[-1][0]):
                return False
            batch = Batch(session, now_s, settings)
            for event in events:
                apply_event(batch, event)
            close_batch(batch)
    except OperationalError:
        raise  # the database is away, which is no event's fault
    except Exception as error:  # one event that cannot be written down must not hold up those behind it
        log.warning("a piece of the stream is followed one by one", after=was, error=repr(error))
        return _follow_singly(database, events, was=was, to=entries[-1][0], now_s=now_s, settings=settings)
    return True


def _follow_singly(
    database: Database, events: Iterable[Event], *, was: str, to: str, now_s: float, settings: Settings
) -> bool:
    with database.writing() as session:
        if not clerk_rows.advance(session, was, to):
            return False
        batch = Batch(session, now_s, settings)
        for event in events:
            if not _is_written(session, partial(apply_event, batch, event), said=event):
                _is_written(session, partial(shift, session, event.job_id, {}, late_events=1), job=event.job_id)
        for job_id in sorted(batch.touched):
            _is_written(session, partial(close_batch, replace(batch, touched={job_id})), job=job_id)
    return True


def _is_written(session: Session, write: Callable[[], None], **what: object) -> bool:
    """Write inside a savepoint; False, and said, if that cannot be done."""
    try:
        with session.begin_nested():
            write()
    except OperationalError:
        raise
    except Exception as error:  # said and counted; the next event is followed
        log.warning("passed over", **what, error=repr(error))
        return False
    return True


def apply_event(batch: Batch, event: Event) -> None:
    """Write down one event."""
    task = _task_of(batch.session, event)
    if task is None or task.attempt != event.attempt or task.status not in HELD_TASKS:
        _come_late(batch, task, event)
        return
    batch.touched.add(task.job_id)
    was = task.status
    _WRITE[event.kind](batch, task, event)
    if task.status is not was:
        tell_task(batch.session, task)


def finish_task(batch: Batch, task: Task, *, cpu_s: float | None, wall_s: float | None) -> None:
    """Write down that a task is done, and let go what waited for it."""
    values = {"cpu_s": cpu_s, "wall_s": wall_s, "progress": 1.0, "ended_s": batch.now_s}
    if move_task(batch.session, task, TaskStatus.DONE, **values, error_code=None, error_message=None):
        unblock(batch.session, task)


def close_batch(batch: Batch) -> None:
    """Settle the jobs that were touched, and tell listeners how far they are."""
    for job_id in sorted(batch.touched):
        row = job_rows.job(batch.session, job_id)
        if row is None:
            continue
        if not settle(batch.session, row, now_s=batch.now_s, failed_share=batch.settings.failed_share):
            tell_progress(batch.session, row)


def hold(batch: Batch, task: Task, worker: str | None) -> None:
    """Write down that an attempt holds its task."""
    if task.status is TaskStatus.DISPATCHED:
        move_task(batch.session, task, TaskStatus.RUNNING, worker=worker, claimed_s=batch.now_s, beat_s=batch.now_s)


def _claimed(batch: Batch, task: Task, event: Event) -> None:
    hold(batch, task, event.worker)


def _beat(batch: Batch, task: Task, event: Event) -> None:
    hold(batch, task, event.worker)
    progress = task.progress if event.progress is None else event.progress
    mine = (Task.job_id == task.job_id, Task.sequence == task.sequence, Task.attempt == task.attempt)
    statement = update(Task).where(*mine, Task.status == TaskStatus.RUNNING)
    changed(batch.session, statement.values(beat_s=batch.now_s, progress=progress))
    batch.session.refresh(task)


def _done(batch: Batch, task: Task, event: Event) -> None:
    if task.kind is TaskKind.PROBE and event.probe is None:
        _fail(batch, task, NO_PROBE, event.worker)
        return
    hold(batch, task, event.worker)
    if event.probe is not None and task.kind is TaskKind.PROBE:
        row = batch.session.get_one(Job, task.job_id, populate_existing=True)
        set_job(batch.session, row, probe=event.probe.model_dump(), chore=Chore.PLAN)
    finish_task(batch, task, cpu_s=event.cpu_s, wall_s=event.wall_s)


def _failed(batch: Batch, task: Task, event: Event) -> None:
    _fail(batch, task, event.failure or NO_REASON, event.worker)


def _declined(batch: Batch, task: Task, event: Event) -> None:
    rest_s = batch.now_s + batch.settings.decline_pause_s
    move_task(batch.session, task, TaskStatus.READY, progress=None, not_before_s=rest_s)


def _fail(batch: Batch, task: Task, failure: Failure, worker: str) -> None:
    hold(batch, task, worker)
    fail_attempt(batch.session, task, failure, worker=worker, now_s=batch.now_s, settings=batch.settings)


_WRITE = {
    EventKind.CLAIMED: _claimed,
    EventKind.BEAT: _beat,
    EventKind.DONE: _done,
    EventKind.FAILED: _failed,
    EventKind.DECLINED: _declined,
}


def _task_of(session: Session, event: Event) -> Task | None:
    try:
        job_id, sequence = parse_task_id(event.task_id)
    except NotFound:
        return None
    return task_rows.task(session, job_id, sequence) if job_id == event.job_id else None


def _come_late(batch: Batch, task: Task | None, event: Event) -> None:
    if task is not None and _was_said(task, event):
        return
    if task is not None:
        shift(batch.session, task.job_id, {}, late_events=1)
    if event.kind in _AT_WORK:
        # It has been told to stop, and the broker may have forgotten that.
        clerk_rows.stop(batch.session, [event.attempt], now_s=batch.now_s)


def _was_said(task: Task, event: Event) -> bool:
    # A task that this very attempt has done: whatever it says of that is old, in whichever order it comes.
    if task.attempt != event.attempt:
        return False
    return task.status is TaskStatus.DONE or task.status in _AFTER.get(event.kind, ())


def _without_old_beats(events: Iterable[Event]) -> list[Event]:
    # Of the beats of an attempt only the last says something: with 2,000 slots most of the stream is beats.
    kept = list(events)
    last = {event.attempt: i for i, event in enumerate(kept) if event.kind is EventKind.BEAT}
    return [event for i, event in enumerate(kept) if event.kind is not EventKind.BEAT or last[event.attempt] == i]
