"""The stream of server-sent events: all events after a position, in order, as they happen."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

from starlette.concurrency import run_in_threadpool

from service.db import events as event_rows
from service.db import jobs as job_rows
from service.db.engine import Database
from service.events.publish import job_snapshot
from service.events.wakeup import Wakeup
from service.schemas.events import EventTopic

POLL_S = 1.0
"""The interval at which a stream polls the database, because another process may have written to it."""
BATCH = 500
GATHER_S = 0.05
"""The time that a stream waits after a wakeup, so that one query reads a burst of events."""


async def stream_events(
    database: Database,
    wakeup: Wakeup,
    *,
    job_id: str | None,
    position: int | None,
    keepalive_s: float,
    is_authorized: Callable[[], bool] = lambda: True,
) -> AsyncIterator[bytes]:
    """Yield server-sent events; without a position, first the present state of the job and then new events.

    `is_authorized` is called every `keepalive_s`, also while there are many events; the stream ends when it is False.
    """
    reached: int = position or 0
    if position is None:
        reached, first = await run_in_threadpool(_beginning, database, job_id)
        yield first
    sent_s = checked_s = time.monotonic()
    with wakeup.for_stream() as woken:
        while not wakeup.closed:
            woken.clear()
            if time.monotonic() - checked_s >= keepalive_s:
                checked_s = time.monotonic()
                if not await run_in_threadpool(is_authorized):
                    return
            events = await run_in_threadpool(_after, database, reached, job_id)
            for identifier, topic, data in events:
                yield encode(identifier, topic, data)
                reached = identifier
            if events:
                sent_s = time.monotonic()
            elif time.monotonic() - sent_s >= keepalive_s:
                sent_s = time.monotonic()
                yield b": alive\n\n"
            if len(events) < BATCH:
                await _wait(woken, min(POLL_S, keepalive_s))


def encode(identifier: int, topic: str, data: dict[str, Any]) -> bytes:
    r"""Return one server-sent event.

    >>> encode(7, "frame", {"frame": 1})
    b'id: 7\nevent: frame\ndata: {"frame":1}\n\n'
    """
    return f"id: {identifier}\nevent: {topic}\ndata: {json.dumps(data, separators=(',', ':'))}\n\n".encode()


async def _wait(woken: asyncio.Event, seconds: float) -> None:
    try:
        async with asyncio.timeout(seconds):
            await woken.wait()
        await asyncio.sleep(GATHER_S)
    except TimeoutError:
        pass


def _beginning(database: Database, job_id: str | None) -> tuple[int, bytes]:
    # Position and job come from one transaction, so that no event is lost or sent twice.
    with database.reading() as session:
        position = event_rows.newest(session)
        row = job_rows.job(session, job_id) if job_id is not None else None
        if row is None:
            return position, f"id: {position}\n: here\n\n".encode()
        return position, encode(position, EventTopic.JOB.value, job_snapshot(session, row).model_dump(mode="json"))


def _after(database: Database, position: int, job_id: str | None) -> list[tuple[int, str, dict[str, Any]]]:
    with database.reading() as session:
        rows = event_rows.after(session, position, job_id=job_id, limit=BATCH)
        return [(row.id, row.topic.value, row.data) for row in rows]
