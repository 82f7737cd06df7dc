"""The queue of one client of the event hub."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Sequence
from functools import cached_property

from service.db.events import StoredEvent
from service.events.sse import ALIVE, comment, encode

QUEUE_BYTES = 256_000
"""The size of a queue beyond which its client has fallen behind and reads the database instead."""


class Batch:
    """Events that follow each other, encoded once for all clients.

    Parameters
    ----------
    events
        One or more events, in order.
    """

    def __init__(self, events: Sequence[StoredEvent]) -> None:
        self.last = events[-1].id
        self._first = events[0].id
        self._events = events
        self._joined: dict[tuple[str | None, str | None], bytes] = {}

    def of_job(self, job_id: str | None, *, after: int, owner_id: str | None = None) -> bytes:
        """Return the events of a job, or of all jobs, after a position; of an owner only those it sees."""
        if after >= self._first:  # The client came while the events were read, and has some of them.
            return self._join(job_id, owner_id, after)
        wanted = job_id, owner_id
        if wanted not in self._joined:
            self._joined[wanted] = self._join(job_id, owner_id, after)
        return self._joined[wanted]

    def _join(self, job_id: str | None, owner_id: str | None, after: int) -> bytes:
        return b"".join(
            data
            for event, data in zip(self._events, self._encoded, strict=True)
            if event.id > after and job_id in (None, event.job_id)
            if event.shared or owner_id in (None, event.owner_id)
        )

    @cached_property
    def _encoded(self) -> list[bytes]:
        return [encode(event.id, event.topic, event.data) for event in self._events]


class Subscription:
    """One client: what it receives, how far it has come, and what the hub holds for it.

    Parameters
    ----------
    job_id
        The job whose events the client receives; None for all jobs.
    caller_id
        The credential of the client; the stream ends when it is no longer valid.
    sent
        The position of the client: it has received every event up to this one.
    owner_id
        The owner who sees the jobs whose events the client receives; None for those of all owners.
    """

    def __init__(self, *, job_id: str | None, caller_id: str, sent: int, owner_id: str | None = None) -> None:
        self.job_id = job_id
        self.owner_id = owner_id
        self.caller_id = caller_id
        self.sent = sent
        self.lags = True
        """True while the hub holds nothing for the client, because it must read the database first."""
        self.is_ended = False
        self._queued = sent
        self._pieces: deque[bytes] = deque()
        self._size = 0
        self._changed = asyncio.Event()

    def follow(self, position: int) -> None:
        """Queue what the hub pushes from now on; the client reads the events up to `position` from the database."""
        self.lags = False
        self._queued = max(position, self.sent)

    def push(self, batch: Batch) -> None:
        """Queue a batch; a client whose queue is full falls behind, and its queue is emptied."""
        if self.lags or self.is_ended or batch.last <= self._queued:
            return
        data = batch.of_job(self.job_id, after=self._queued, owner_id=self.owner_id)
        # A single batch always has room: all clients share its bytes, and an idle client never falls behind.
        if self._pieces and self._size + len(data) > QUEUE_BYTES:
            self.lags = True
            self._clear()
        else:
            self._queued = batch.last
            if data:
                self._append(data)

    def keep_alive(self) -> None:
        """Queue a comment, unless something else is queued."""
        if not self._pieces and not self.lags:
            self._append(ALIVE)

    def end(self, reason: str) -> None:
        """End the stream; its last line is a comment with the reason."""
        if not self.is_ended:
            self.is_ended = True
            self._clear()
            self._append(comment(reason))

    def take(self) -> bytes:
        """Return what is queued, and empty the queue."""
        data = b"".join(self._pieces)
        self._clear()
        if not self.lags:
            self.sent = self._queued
        return data

    async def wait(self) -> None:
        """Wait until something is queued, or the client has fallen behind."""
        await self._changed.wait()
        self._changed.clear()

    def _append(self, data: bytes) -> None:
        self._pieces.append(data)
        self._size += len(data)
        self._changed.set()

    def _clear(self) -> None:
        self._pieces.clear()
        self._size = 0
