"""The event consumer writes the events of workers to the database, each once, and only while its attempt owns the task.

The position in the stream advances in the same transaction as the rows, so an event that is read twice counts once. An
event that cannot be written is logged, counted as late and skipped, so that it never blocks the stream.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import structlog
from sqlalchemy import update
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from lippmann.digest import Digest
from lippmann.job.messages.events import Event, EventKind, Failure
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import HELD_TASKS, TaskStatus
from service.broker_stream import Entry
from service.coordinator.retry_policy import fail_attempt
from service.db import coordinator as coordinator_rows
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.counters import add_to_counters
from service.db.engine import Database, changed
from service.db.tables import BackgroundJob, Job, Task
from service.errors import NotFound
from service.events.publish import publish_progress, publish_task
from service.ids import parse_task_id
from service.jobs.completion import settle, unblock
from service.jobs.state_machine import set_job, transition_task
from service.settings import Settings

NO_PROBE = Failure(code="probe-empty", message="the probe ended without a measurement", permanent=False)
NO_REASON = Failure(code="unknown", message="the worker gave no reason", permanent=False)

NO_ERROR = dict.fromkeys(("error_code", "error_message", "error_frame", "error_artifact"))
"""The columns of the last error of a task that is done."""

_AFTER = {
    EventKind.FAILED: (TaskStatus.READY, TaskStatus.FAILED),
    EventKind.DECLINED: (TaskStatus.READY,),
}
"""The statuses of a task after an event. An event that finds them, from the same attempt, is a repetition."""
_WORKING = frozenset({EventKind.CLAIMED, EventKind.HEARTBEAT})
"""The events of an attempt that works."""

log = structlog.get_logger("service.event_consumer")


@dataclass
class Batch:
    """One transaction: its time, the settings, and the jobs that it touches."""

    session: Session
    now_s: float
    settings: Settings
    touched: set[str] = field(default_factory=set)


def consume_events(database: Database, entries: Sequence[Entry], *, was: str, now_s: float, settings: Settings) -> bool:
    """Write a chunk of the stream that begins after position `was`; return False if another process wrote it."""
    events = _without_old_heartbeats(event for _, event in entries if event is not None)
    try:
        with database.writing() as session:
            if not coordinator_rows.advance_position(session, was, entries[-1][0]):
                return False
            batch = Batch(session, now_s, settings)
            for event in events:
                apply_event(batch, event)
            close_batch(batch)
    except OperationalError:
        raise  # the database is unavailable, which is no fault of the events
    except Exception as error:  # one event that cannot be written must not block those behind it
        log.warning("a chunk of the stream is written event by event", after=was, error=repr(error))
        return _consume_singly(database, events, was=was, to=entries[-1][0], now_s=now_s, settings=settings)
    return True


def _consume_singly(
    database: Database, events: Iterable[Event], *, was: str, to: str, now_s: float, settings: Settings
) -> bool:
    with database.writing() as session:
        if not coordinator_rows.advance_position(session, was, to):
            return False
        batch = Batch(session, now_s, settings)
        for event in events:
            if not _is_written(session, partial(apply_event, batch, event), worker_event=event):
                _is_written(
                    session, partial(add_to_counters, session, event.job_id, {}, late_events=1), job=event.job_id
                )
        for job_id in sorted(batch.touched):
            _is_written(session, partial(close_batch, replace(batch, touched={job_id})), job=job_id)
    return True


def _is_written(session: Session, write: Callable[[], None], **what: object) -> bool:
    """Write inside a savepoint; log an error and return False if that fails."""
    try:
        with session.begin_nested():
            write()
    except OperationalError:
        raise
    except Exception as error:  # logged and counted; the next event is written
        log.warning("skipped", **what, error=repr(error))
        return False
    return True


def apply_event(batch: Batch, event: Event) -> None:
    """Write one event."""
    task = _task_of(batch.session, event)
    if task is None or task.attempt != event.attempt or task.status not in HELD_TASKS:
        _count_late(batch, task, event)
        return
    batch.touched.add(task.job_id)
    was = task.status
    _WRITE[event.kind](batch, task, event)
    if task.status is not was:
        publish_task(batch.session, task)


def finish_task(
    batch: Batch, task: Task, *, cpu_s: float | None, wall_s: float | None, digests: Mapping[str, Digest] | None
) -> None:
    """Record that a task is done, and make ready the tasks that need it."""
    values = {"cpu_s": cpu_s, "wall_s": wall_s, "progress": 1.0, "ended_s": batch.now_s, "digests": digests or None}
    if transition_task(batch.session, task, TaskStatus.DONE, **values, **NO_ERROR):
        unblock(batch.session, task)


def close_batch(batch: Batch) -> None:
    """End the touched jobs whose tasks have ended, and publish the progress of the others."""
    for job_id in sorted(batch.touched):
        row = job_rows.job(batch.session, job_id)
        if row is None:
            continue
        if not settle(batch.session, row, now_s=batch.now_s, limit=batch.settings.failure_limit):
            publish_progress(batch.session, row)


def hold(batch: Batch, task: Task, worker: str | None, instance: str | None) -> None:
    """Record that an attempt of a worker process owns its task."""
    if task.status is TaskStatus.DISPATCHED:
        values = {"worker": worker, "instance": instance, "claimed_s": batch.now_s, "heartbeat_s": batch.now_s}
        transition_task(batch.session, task, TaskStatus.RUNNING, **values)


def _claimed(batch: Batch, task: Task, event: Event) -> None:
    hold(batch, task, event.worker, event.instance)


def _heartbeat(batch: Batch, task: Task, event: Event) -> None:
    hold(batch, task, event.worker, event.instance)
    progress = task.progress if event.progress is None else event.progress
    mine = (Task.job_id == task.job_id, Task.sequence == task.sequence, Task.attempt == task.attempt)
    statement = update(Task).where(*mine, Task.status == TaskStatus.RUNNING)
    changed(batch.session, statement.values(heartbeat_s=batch.now_s, progress=progress))
    batch.session.refresh(task)


def _done(batch: Batch, task: Task, event: Event) -> None:
    if task.kind is TaskKind.PROBE and event.probe is None:
        _fail(batch, task, NO_PROBE, event)
        return
    hold(batch, task, event.worker, event.instance)
    if event.probe is not None and task.kind is TaskKind.PROBE:
        row = batch.session.get_one(Job, task.job_id, populate_existing=True)
        set_job(batch.session, row, probe=event.probe.model_dump(), background_job=BackgroundJob.PLAN)
    finish_task(batch, task, cpu_s=event.cpu_s, wall_s=event.wall_s, digests=event.digests)


def _failed(batch: Batch, task: Task, event: Event) -> None:
    _fail(batch, task, event.failure or NO_REASON, event)


def _declined(batch: Batch, task: Task, event: Event) -> None:
    due_s = batch.now_s + batch.settings.decline_pause_s
    transition_task(batch.session, task, TaskStatus.READY, progress=None, not_before_s=due_s)


def _fail(batch: Batch, task: Task, failure: Failure, event: Event) -> None:
    hold(batch, task, event.worker, event.instance)
    fail_attempt(batch.session, task, failure, worker=event.worker, now_s=batch.now_s, settings=batch.settings)


_WRITE = {
    EventKind.CLAIMED: _claimed,
    EventKind.HEARTBEAT: _heartbeat,
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


def _count_late(batch: Batch, task: Task | None, event: Event) -> None:
    if task is not None and _is_repetition(task, event):
        return
    if task is not None:
        add_to_counters(batch.session, task.job_id, {}, late_events=1)
    if event.kind in _WORKING:
        # A stop was requested earlier, and the broker may have lost the signal.
        coordinator_rows.request_stop(batch.session, [event.attempt], now_s=batch.now_s)


def _is_repetition(task: Task, event: Event) -> bool:
    # Once this attempt has done the task, its further events are repetitions, in whichever order they arrive.
    if task.attempt != event.attempt:
        return False
    return task.status is TaskStatus.DONE or task.status in _AFTER.get(event.kind, ())


def _without_old_heartbeats(events: Iterable[Event]) -> list[Event]:
    # Only the last heartbeat of an attempt matters, and with 2,000 slots most events are heartbeats.
    kept = list(events)
    last = {event.attempt: i for i, event in enumerate(kept) if event.kind is EventKind.HEARTBEAT}
    return [event for i, event in enumerate(kept) if event.kind is not EventKind.HEARTBEAT or last[event.attempt] == i]
