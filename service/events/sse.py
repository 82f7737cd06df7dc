"""What one listener hears: everything after a position, in order, as it happens."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable
from typing import Any

from starlette.concurrency import run_in_threadpool

from service.api.presenters import show_job
from service.db import events as event_rows
from service.db import jobs as job_rows
from service.db.engine import Database
from service.db.tables import EventTopic
from service.events.wakeup import Bell

LOOK_S = 1.0
"""How often a stream looks by itself, for what another process wrote."""
BATCH = 500
GATHER_S = 0.05
"""How long a stream waits after the bell, so that a burst is one query."""


async def listen(
    database: Database,
    bell: Bell,
    *,
    job_id: str | None,
    position: int | None,
    keepalive_s: float,
    may_listen: Callable[[], bool] = lambda: True,
) -> AsyncIterator[bytes]:
    """Yield server-sent events; without a position, first how the job stands and then what is new.

    `may_listen` is asked every `keepalive_s`, also when there is much to say; who no longer may hears no more.
    """
    reached: int = position or 0
    if position is None:
        reached, first = await run_in_threadpool(_beginning, database, job_id)
        yield first
    said_s = asked_s = time.monotonic()
    with bell.in_stream() as woken:
        while not bell.closed:
            woken.clear()
            if time.monotonic() - asked_s >= keepalive_s:
                asked_s = time.monotonic()
                if not await run_in_threadpool(may_listen):
                    return
            events = await run_in_threadpool(_after, database, reached, job_id)
            for identifier, topic, data in events:
                yield encode(identifier, topic, data)
                reached = identifier
            if events:
                said_s = time.monotonic()
            elif time.monotonic() - said_s >= keepalive_s:
                said_s = time.monotonic()
                yield b": alive\n\n"
            if len(events) < BATCH:
                await _wait(woken, min(LOOK_S, keepalive_s))


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
    # Position and summary from one transaction: nothing falls between them, and nothing comes twice.
    with database.reading() as session:
        position = event_rows.newest(session)
        row = job_rows.job(session, job_id) if job_id is not None else None
        if row is None:
            return position, f"id: {position}\n: here\n\n".encode()
        return position, encode(position, EventTopic.JOB.value, show_job(session, row).model_dump(mode="json"))


def _after(database: Database, position: int, job_id: str | None) -> list[tuple[int, str, dict[str, Any]]]:
    with database.reading() as session:
        rows = event_rows.after(session, position, job_id=job_id, limit=BATCH)
        return [(row.id, row.topic.value, row.data) for row in rows]
