"""The event consumer writes the events of workers to the database, each once, and only while its attempt owns the task.

A chunk of the stream is read, applied in memory by `service.coordinator.event_rules`, and written by a handful of
statements. The position in the stream advances in the same transaction as the rows, so an event that is read twice
counts once. An event that cannot be written is logged, counted as late and skipped, so that it never blocks the stream.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial

import structlog
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from lippmann.job.messages.events import Event
from service.broker_stream import Entry
from service.coordinator.batch_writer import close_jobs, write_batch
from service.coordinator.event_rules import Batch, fold_events, task_key, without_old_heartbeats
from service.db import coordinator as coordinator_rows
from service.db import task_sets
from service.db.counters import add_to_counters
from service.db.engine import Database
from service.errors import NotLeading
from service.instruments import Outcome, count_attempts
from service.settings import Settings

log = structlog.get_logger("service.event_consumer")


def consume_events(database: Database, entries: Sequence[Entry], *, was: str, now_s: float, settings: Settings) -> bool:
    """Write a chunk of the stream that begins after position `was`; return False if another process wrote it."""
    events = without_old_heartbeats(event for _, event in entries if event is not None)
    try:
        with database.writing() as session:
            if not coordinator_rows.advance_position(session, was, entries[-1][0]):
                return False
            batch = write_events(session, events, now_s=now_s, settings=settings)
            close_jobs(session, batch.touched, now_s=now_s, settings=settings)
    except (OperationalError, NotLeading):
        raise  # the database is unavailable, or another process leads, which is no fault of the events
    except Exception as error:  # one event that cannot be written must not block those behind it
        log.warning("a chunk of the stream is written event by event", after=was, error=repr(error))
        return _consume_singly(database, events, was=was, to=entries[-1][0], now_s=now_s, settings=settings)
    count_attempts(batch.outcomes)
    return True


def write_events(session: Session, events: Sequence[Event], *, now_s: float, settings: Settings) -> Batch:
    """Write events, and return what they changed."""
    keys = {key for key in map(task_key, events) if key is not None}
    batch = fold_events(task_sets.states(session, keys), events, now_s=now_s, settings=settings)
    write_batch(session, batch)
    return batch


def _consume_singly(
    database: Database, events: Sequence[Event], *, was: str, to: str, now_s: float, settings: Settings
) -> bool:
    touched: set[str] = set()
    outcomes: Counter[Outcome] = Counter()

    def write(event: Event) -> None:
        batch = write_events(session, [event], now_s=now_s, settings=settings)
        touched.update(batch.touched)
        outcomes.update(batch.outcomes)

    with database.writing() as session:
        if not coordinator_rows.advance_position(session, was, to):
            return False
        for event in events:
            if not _is_written(session, partial(write, event), worker_event=event):
                count = partial(add_to_counters, session, {event.job_id: {"late_events": 1}})
                _is_written(session, count, job=event.job_id)
        for job_id in sorted(touched):
            close = partial(close_jobs, session, {job_id}, now_s=now_s, settings=settings)
            _is_written(session, close, job=job_id)
    count_attempts(outcomes)
    return True


def _is_written(session: Session, write: Callable[[], None], **what: object) -> bool:
    """Write inside a savepoint; log an error and return False if that fails."""
    try:
        with session.begin_nested():
            write()
    except (OperationalError, NotLeading):
        raise
    except Exception as error:  # logged and counted; the next event is written
        log.warning("skipped", **what, error=repr(error))
        return False
    return True
