"""The event hub: one reader of a process for all clients of the event stream.

After a change, one query reads the new events, each of them is encoded once, and all clients receive the same bytes in
the event loop; a client takes no thread. A client that comes with an older position, or that has fallen behind, reads
pages of its own from the database up to the position of the hub, and continues with what the hub has pushed meanwhile.
If what it lacks is no longer stored, it receives a `reset` event instead, and reads anew what it shows.
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections import Counter
from collections.abc import AsyncGenerator, AsyncIterator, Awaitable, Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import accumulate
from operator import methodcaller
from typing import Any, TypeVar

import structlog
from sqlalchemy.exc import SQLAlchemyError

from lippmann.logs import trace_of
from service.db import access as access_rows
from service.db import events as event_rows
from service.db import jobs as job_rows
from service.db.engine import Database
from service.db.events import StoredEvent
from service.errors import TooManyRequests
from service.events.publish import job_snapshot
from service.events.sse import comment, encode
from service.events.subscription import Batch, Subscription
from service.events.wakeup import Wakeup
from service.instruments import Refusal, count_refusal
from service.schemas.events import EventTopic, Reset

log = structlog.get_logger("service.events")

Answer = TypeVar("Answer")

CHECK_S = 2.0
"""The longest interval at which the credentials of clients are checked, because another process may revoke them."""
POLL_S = 1.0
"""The interval at which the hub polls the database, because another process may have written to it."""
BATCH = 200
"""The number of events that one query reads."""
BATCH_BYTES = 256_000
"""The size of events beyond which a batch ends early, because a client may hold a whole one."""
PAUSE_S = 0.05
"""The shortest pause between two queries, so that one query reads a burst of events."""
LONGEST_PAUSE_S = 0.5
PAUSE_RATIO = 3.0
"""The pause in parts of the time that the events before took, so that clients leave the event loop to requests."""
CLIENTS_AT_ONCE = 20
"""The number of clients that are served before the event loop turns to requests."""
SENT_AT_ONCE_BYTES = 65_536
CATCH_UP_THREADS = 2
STREAM_RETRY_S = 30.0
"""The time after which a client with too many streams may try again."""
RESET = Reset(reason="Events are missing that are no longer stored; read anew what you show.")


class EventHub:
    """Distributes the events of a database to the clients of this process.

    Parameters
    ----------
    database, wakeup
        The hub reads the database when it is woken, and every second.
    keepalive_s
        The interval at which idle clients receive a comment.
    now_s
        Returns seconds since 1970, UTC.
    has_owners
        True if some clients receive only the events of the jobs that their owner sees.
    idle_s
        The time without a request after which a browser session has ended, and its streams with it.
    """

    def __init__(
        self,
        database: Database,
        wakeup: Wakeup,
        *,
        keepalive_s: float,
        now_s: Callable[[], float] = time.time,
        has_owners: bool = False,
        idle_s: float = math.inf,
    ) -> None:
        self._database = database
        self._wakeup = wakeup
        self._keepalive_s = keepalive_s
        self._now_s = now_s
        self._has_owners = has_owners
        self._idle_s = idle_s
        self._clients: set[Subscription] = set()
        self._streams: Counter[str] = Counter()
        """The number of streams of each credential, from the request on."""
        self._position: int | None = None
        """All clients have, or have queued, the events up to this one; None while there are no clients."""
        self._woken = asyncio.Event()
        self._revoked = asyncio.Event()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self._is_closed = False
        self._reader = ThreadPoolExecutor(1, thread_name_prefix="event-hub")
        self._catch_up = ThreadPoolExecutor(CATCH_UP_THREADS, thread_name_prefix="event-catch-up")

    @property
    def streams(self) -> int:
        """The number of open event streams of this process."""
        return sum(self._streams.values())

    def start(self) -> None:
        """Start to distribute events, in the running event loop."""
        self._loop = asyncio.get_running_loop()
        loops = (self._distribute_always, self._keep_alive_always, self._check_always)
        self._tasks = [asyncio.create_task(loop()) for loop in loops]

    def check_credentials(self) -> None:
        """End the streams of revoked credentials now; any thread may call this after it has revoked some."""
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._revoked.set)

    @contextmanager
    def counted(self, caller_id: str, *, most: int) -> Iterator[None]:
        """Count a stream of a credential while the context lasts.

        Raises
        ------
        TooManyRequests
            If the credential has as many streams, in this process.
        """
        if self._streams[caller_id] >= most:
            count_refusal(Refusal.STREAMS)
            raise TooManyRequests("the key has too many open event streams", retry_after_s=STREAM_RETRY_S)
        self._streams[caller_id] += 1
        try:
            yield
        finally:
            self._streams[caller_id] -= 1
            if not self._streams[caller_id]:
                del self._streams[caller_id]

    def end_streams(self) -> None:
        """End the streams of all clients, and of those that come later."""
        self._is_closed = True
        for client in self._clients:
            client.end("the service stops")

    async def close(self) -> None:
        """End all streams, and wait until no query is running."""
        self.end_streams()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        for executor in (self._reader, self._catch_up):
            await asyncio.to_thread(executor.shutdown)

    async def stream(
        self, *, job_id: str | None, caller_id: str, position: int | None, owner_id: str | None = None
    ) -> AsyncGenerator[bytes]:
        """Yield server-sent events; without a position, first the present state of the job and then new events.

        Parameters
        ----------
        job_id
            The job whose events are sent; None for all jobs.
        caller_id
            The credential of the client; the stream ends when it is no longer valid.
        position
            The last event that the client has received.
        owner_id
            The owner who sees the jobs whose events are sent; None for those of all owners.
        """
        if self._is_closed:
            return
        newest, first = await self._in(self._catch_up, self._beginning, job_id)
        if position is not None and not await self._in(self._catch_up, self._are_kept, position):
            yield _reset(newest)
            position = None
        if position is None:
            yield first
        sent = newest if position is None else position
        client = Subscription(job_id=job_id, caller_id=caller_id, sent=sent, owner_id=owner_id)
        with self._joined(client, newest):
            async for data in self._received(client):
                for start in range(0, len(data), SENT_AT_ONCE_BYTES):
                    yield data[start : start + SENT_AT_ONCE_BYTES]

    @contextmanager
    def _joined(self, client: Subscription, newest: int) -> Iterator[None]:
        if self._position is None:
            self._position = newest
            self._woken.set()  # There may be newer events, and the hub slept over their wakeup.
        self._clients.add(client)
        if self._is_closed:
            client.end("the service stops")
        try:
            yield
        finally:
            self._clients.discard(client)
            if not self._clients:
                self._position = None

    async def _received(self, client: Subscription) -> AsyncIterator[bytes]:
        while not client.is_ended:
            if client.lags:
                async for page in self._missed(client):
                    yield page
            elif data := client.take():
                yield data
            else:
                await client.wait()
        yield client.take()

    async def _missed(self, client: Subscription) -> AsyncIterator[bytes]:
        """Yield pages of the database up to the position of the hub, while the hub queues what follows."""
        until = self._position or 0
        client.follow(until)
        while client.sent < until and not client.is_ended:
            events, is_last = await self._in(
                self._catch_up, self._page, client.sent, until, client.job_id, client.owner_id
            )
            # Checked after the page was read, since events may be deleted at any time.
            if not await self._in(self._catch_up, self._are_kept, client.sent):
                client.sent = until
                yield _reset(until)
                return
            client.sent = until if is_last else events[-1].id
            if events:
                yield Batch(events).of_job(client.job_id, after=-1, owner_id=client.owner_id)

    async def _distribute_always(self) -> None:
        with self._wakeup.for_coroutine() as self._woken:
            while True:
                with suppress(TimeoutError):
                    async with asyncio.timeout(POLL_S):
                        await self._woken.wait()
                self._woken.clear()
                begun_s = time.monotonic()
                await self._logged(self._distribute)
                spent_s = time.monotonic() - begun_s
                await asyncio.sleep(min(LONGEST_PAUSE_S, max(PAUSE_S, PAUSE_RATIO * spent_s)))

    async def _distribute(self) -> None:
        """Read the new events and push them to all clients."""
        while (position := self._position) is not None:
            events, is_last = await self._in(self._reader, self._page, position, None, None, None)
            if self._position != position:
                continue  # All clients have gone meanwhile, and others have come.
            if events:
                batch = Batch(events)
                # The position moves first: who joins now reads these events from the database.
                self._position = batch.last
                await self._for_each(methodcaller("push", batch))
            if is_last:
                return

    async def _keep_alive_always(self) -> None:
        while True:
            await asyncio.sleep(self._keepalive_s)
            await self._for_each(Subscription.keep_alive)

    async def _check_always(self) -> None:
        while True:
            with suppress(TimeoutError):
                async with asyncio.timeout(min(CHECK_S, self._keepalive_s)):
                    await self._revoked.wait()
            self._revoked.clear()
            await self._logged(self._end_invalid)

    async def _end_invalid(self) -> None:
        """End the streams of clients whose credentials were revoked or have expired."""
        asked = {client.caller_id for client in self._clients}
        if asked:
            valid = await self._in(self._reader, self._valid, asked)
            for client in list(self._clients):
                if client.caller_id in asked - valid:
                    client.end("the key or the session is no longer valid")

    async def _for_each(self, do: Callable[[Subscription], None]) -> None:
        for number, client in enumerate(list(self._clients), start=1):
            do(client)
            if number % CLIENTS_AT_ONCE == 0:
                await asyncio.sleep(0)

    async def _logged(self, run: Callable[[], Awaitable[None]]) -> None:
        """Run; whatever fails, such as a database that is away, the streams stay open, and the next round follows."""
        try:
            await run()
        except Exception as error:  # the outermost frame of the task
            trace = "" if isinstance(error, SQLAlchemyError) else trace_of(error)
            log.warning("events cannot be read", error=repr(error), trace=trace)
            await asyncio.sleep(POLL_S)

    async def _in(self, executor: ThreadPoolExecutor, run: Callable[..., Answer], *values: Any) -> Answer:
        return await asyncio.get_running_loop().run_in_executor(executor, run, *values)

    def _beginning(self, job_id: str | None) -> tuple[int, bytes]:
        # The position is read first, so that no event is lost.
        with self._database.reading() as session:
            position = event_rows.newest(session)
            row = job_rows.job(session, job_id) if job_id is not None else None
            if row is None:
                return position, comment("here", identifier=position)
            # ASCII, since some clients also end lines at the line separators of Unicode.
            data = json.dumps(job_snapshot(session, row).model_dump(mode="json"), separators=(",", ":"))
            return position, encode(position, EventTopic.JOB, data)

    def _page(
        self, after: int, until: int | None, job_id: str | None, owner_id: str | None
    ) -> tuple[Sequence[StoredEvent], bool]:
        """Return the next events, and whether there are no more."""
        with self._database.reading() as session:
            events = event_rows.after(
                session, after, until=until, job_id=job_id, limit=BATCH, owner_id=owner_id, has_owners=self._has_owners
            )
        sizes = accumulate(len(event.data) for event in events)
        count = 1 + sum(size < BATCH_BYTES for size in sizes)
        return events[:count], len(events) < BATCH and count >= len(events)

    def _are_kept(self, position: int) -> bool:
        with self._database.reading() as session:
            return event_rows.are_kept(session, position)

    def _valid(self, caller_ids: set[str]) -> set[str]:
        with self._database.reading() as session:
            return access_rows.valid(session, caller_ids, now_s=self._now_s(), idle_s=self._idle_s)


def _reset(position: int) -> bytes:
    return encode(position, EventTopic.RESET, RESET.model_dump_json())
