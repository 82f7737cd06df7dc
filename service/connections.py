"""The connections of the service before anybody has logged in: deadlines, and caps in all and by address.

uvicorn has no deadline for the headers and the body of a request and closes nothing when descriptors run out. Without
them, a thousand half requests keep everybody out, the coordinator and the database included.

| connection | ends |
|---|---|
| without a complete request line and headers | after `headers_s`, with 408; at `HEAD_BYTES`, with 431 |
| whose body arrives too slowly | after `body_s` with less than `BODY_BYTES`, with 408 |
| whose client does not read the answer | after `STALLED_S` |
| above a cap | the oldest one of the first phase that has any is closed: held, waits for a request, waits for a body |
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from enum import IntEnum
from ipaddress import IPv4Network, IPv6Network, ip_address
from typing import Any

import structlog
from uvicorn.protocols.http.httptools_impl import STATUS_LINE, HttpToolsProtocol

RESERVE = 256
"""The descriptors that connections leave to the database, the broker, the store and the coordinator."""
DESCRIPTORS = 2
"""The descriptors of one connection: the socket, and the file that is sent over it."""
FEWEST = 16
HEAD_BYTES = 65_536
"""The largest size of the request line and the headers."""
BODY_BYTES = 100_000
"""The bytes of a body that must arrive in each `body_s`."""
STALLED_S = 120.0
"""The time in which a client must read something of an answer that waits for it."""
SWEEP_S = 1.0
"""The interval at which the deadlines of a connection are checked."""
SWEPT_AT_ONCE = 100
"""The number of connections that are checked before the event loop turns to requests."""
HOLD = "lippmann.hold"
"""The ASGI extension of a connection: a coroutine function that waits for some seconds before an answer is sent."""
LOG_S = 10.0
"""The interval at which the log says how many connections were closed, and that a request could not be parsed."""

log = structlog.get_logger("service.connections")


class _Seldom(logging.Filter):
    """Lets a line of uvicorn through only now and then, which anybody can cause without a key."""

    LINE = "Invalid HTTP request received."

    def __init__(self) -> None:
        super().__init__()
        self._logged_s = float("-inf")

    def filter(self, record: logging.LogRecord) -> bool:
        if record.msg != self.LINE:
            return True
        now_s, was_s = time.monotonic(), self._logged_s
        if now_s - was_s > LOG_S:
            self._logged_s = now_s
        return now_s - was_s > LOG_S


logging.getLogger("uvicorn.error").addFilter(_Seldom())


class Phase(IntEnum):
    """The thing that a connection waits for. A smaller phase is closed earlier when there are too many connections."""

    HELD = 0
    """For an answer that is held back, whatever else it waits for."""
    REQUEST = 1
    """For a request, or for the rest of its headers."""
    BODY = 2
    """For the rest of a body."""
    ANSWER = 3
    """For the service."""


@dataclass(frozen=True)
class ConnectionLimits:
    """The limits of the connections of one process."""

    total: int
    by_address: int
    headers_s: float
    body_s: float
    exempt: tuple[IPv4Network | IPv6Network, ...] = ()
    """The networks of reverse proxies, each of which carries the connections of many."""

    def of_address(self, address: str) -> int:
        """Return the largest number of connections from an address."""
        try:
            is_proxy = any(ip_address(address) in network for network in self.exempt)
        except ValueError:
            is_proxy = False
        return self.total if is_proxy else self.by_address


def most_connections(descriptors: int, wanted: int) -> int:
    """Return the number of connections for which there are descriptors, at most the wanted one.

    >>> most_connections(1024, 4096), most_connections(20_000, 4096)
    (384, 4096)
    """
    return max(FEWEST, min(wanted, (descriptors - RESERVE) // DESCRIPTORS))


class ConnectionGuard:
    """Knows the connections of one server, and closes those that are over a deadline or over a cap.

    Each of its steps takes the same time, however many connections there are.
    """

    def __init__(self, limits: ConnectionLimits) -> None:
        self.limits = limits
        self.closed = 0
        """The number of connections that were closed because there were too many."""
        self._all = _Connections()
        self._by_address: dict[str, _Connections] = {}
        self._unchecked: deque[GuardedProtocol] = deque()
        """The connections whose deadlines are still to be checked in this round."""
        self._sweeper: asyncio.TimerHandle | None = None
        self._logged_s = float("-inf")

    def protocol(self, **options: Any) -> GuardedProtocol:
        """Return the protocol of a new connection, as uvicorn asks for it."""
        return GuardedProtocol(self, **options)

    def add(self, connection: GuardedProtocol) -> None:
        """Add a new connection, and close another one, or this one, if there are too many."""
        address = connection.address
        of_address = self._by_address.setdefault(address, _Connections())
        self._all.enter(connection)
        of_address.enter(connection)
        if len(of_address) > self.limits.of_address(address):
            self._make_room(of_address, connection)
        elif len(self._all) > self.limits.total:
            self._make_room(self._all, connection)
        if self._sweeper is None:
            self._sweeper = asyncio.get_running_loop().call_later(SWEEP_S, self._sweep)

    def remove(self, connection: GuardedProtocol) -> None:
        """Forget a connection that has ended."""
        if connection not in self._all:
            return
        self._all.remove(connection)
        of_address = self._by_address[connection.address]
        of_address.remove(connection)
        if not len(of_address):
            del self._by_address[connection.address]

    def enter(self, connection: GuardedProtocol) -> None:
        """Note that a connection waits for something else from now on."""
        if connection in self._all:
            self._all.enter(connection)
            self._by_address[connection.address].enter(connection)

    def _make_room(self, among: _Connections, new: GuardedProtocol) -> None:
        victim = among.oldest_besides(new) or new
        self.closed += 1
        if time.monotonic() - self._logged_s > LOG_S:
            self._logged_s = time.monotonic()
            log.warning("too many connections", closed=self.closed, open=len(self._all), address=new.address)
        self.remove(victim)
        victim.abort()

    def _sweep(self) -> None:
        if not self._unchecked:
            self._unchecked.extend(self._all)
        now_s, share = time.monotonic(), SWEPT_AT_ONCE / max(SWEPT_AT_ONCE, len(self._all))
        for _ in range(min(SWEPT_AT_ONCE, len(self._unchecked))):
            connection = self._unchecked.popleft()
            if connection in self._all:
                connection.check_deadlines(now_s, self.limits)
        again = asyncio.get_running_loop().call_later
        self._sweeper = again(SWEEP_S * share, self._sweep) if len(self._all) else None


class _Connections:
    """Connections by what they wait for, in the order in which they began to."""

    def __init__(self) -> None:
        self._phases: dict[GuardedProtocol, Phase] = {}
        self._waiting: dict[Phase, dict[GuardedProtocol, None]] = {phase: {} for phase in Phase}

    def __len__(self) -> int:
        return len(self._phases)

    def __contains__(self, connection: GuardedProtocol) -> bool:
        return connection in self._phases

    def __iter__(self) -> Iterator[GuardedProtocol]:
        return iter(self._phases)

    def enter(self, connection: GuardedProtocol) -> None:
        if connection in self._phases:
            self.remove(connection)
        self._phases[connection] = connection.phase
        self._waiting[connection.phase][connection] = None

    def remove(self, connection: GuardedProtocol) -> None:
        del self._waiting[self._phases.pop(connection)][connection]

    def oldest_besides(self, new: GuardedProtocol) -> GuardedProtocol | None:
        """Return the oldest connection of the smallest phase; none that waits for the service."""
        phases = (Phase.HELD, Phase.REQUEST, Phase.BODY)
        return next((one for phase in phases for one in self._waiting[phase] if one is not new), None)


class GuardedProtocol(HttpToolsProtocol):
    """The HTTP protocol of uvicorn with deadlines; it tells the guard what it waits for."""

    def __init__(self, guard: ConnectionGuard, **options: Any) -> None:
        super().__init__(**options)
        self._guard = guard
        self.address = ""
        """The address of the peer."""
        self._phase = Phase.REQUEST
        self._is_held = False
        self._over = asyncio.Event()
        """Set when the connection has ended, or is to end because the server stops."""
        self.since_s = time.monotonic()
        """The time since when the connection is in its phase."""
        self._received_bytes = 0
        """The bytes of the headers or of the body since then."""
        self._unread_s: float | None = None
        """The time since when an answer waits and the client has read nothing; None if no answer waits."""
        self._unread_bytes = 0
        """The bytes that waited then."""

    @property
    def phase(self) -> Phase:
        """The thing that the connection waits for; an answer that is held back comes first."""
        return Phase.HELD if self._is_held else self._phase

    async def hold(self, wait_s: float) -> None:
        """Wait for some seconds before an answer is sent, but not beyond the end of the connection or of the server."""
        self._is_held = True
        self._enter(self._phase)
        try:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._over.wait(), wait_s)
        finally:
            self._is_held = False
            self._enter(self._phase)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a request."""
        super().connection_made(transport)
        self.address = self.client[0] if self.client else ""
        self._guard.add(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        self._guard.remove(self)
        self._over.set()
        super().connection_lost(exc)

    def on_headers_complete(self) -> None:
        """Begin to wait for the body."""
        self._enter(Phase.BODY)
        extensions: Any = {HOLD: self.hold}
        self.scope["extensions"] = extensions
        super().on_headers_complete()

    def data_received(self, data: bytes) -> None:
        """Count what arrives, and parse it."""
        self._received_bytes += len(data)
        super().data_received(data)
        if self.phase is Phase.REQUEST and self._received_bytes > HEAD_BYTES and not self.transport.is_closing():
            self._end(431, "The headers of the request are too large.")

    def on_message_complete(self) -> None:
        """Begin to wait for the service, unless it has answered before the whole body arrived."""
        self._enter(Phase.REQUEST if self.cycle.response_complete else Phase.ANSWER)
        super().on_message_complete()

    def on_response_complete(self) -> None:
        """Begin to wait for the next request."""
        if not self.pipeline:
            self._enter(Phase.REQUEST)
        super().on_response_complete()

    def shutdown(self) -> None:
        """Begin to end the connection, since the server stops."""
        super().shutdown()
        self._over.set()

    def pause_writing(self) -> None:
        """Begin to wait for the client to read."""
        self._unread_s, self._unread_bytes = time.monotonic(), self.transport.get_write_buffer_size()
        super().pause_writing()

    def resume_writing(self) -> None:
        """End to wait for the client to read."""
        self._unread_s = None
        super().resume_writing()

    def check_deadlines(self, now_s: float, limits: ConnectionLimits) -> None:
        """End the connection if its client is over a deadline."""
        unread_bytes = self.transport.get_write_buffer_size()
        if self.transport.is_closing():
            self._unread_s = self._unread_s or now_s
        if self._unread_s is not None and unread_bytes != self._unread_bytes:
            self._unread_s, self._unread_bytes = now_s, unread_bytes
        if self._unread_s is not None and now_s - self._unread_s > STALLED_S:
            self.abort()
        if self.transport.is_closing():
            return
        if self.phase is Phase.REQUEST and now_s - self.since_s > limits.headers_s:
            self._end(408, "The headers of the request did not arrive in time.")
        elif self.phase is Phase.BODY and (self.flow.read_paused or self.cycle.waiting_for_100_continue):
            self._enter(Phase.BODY)  # The service is what the body waits for.
        elif self.phase is Phase.BODY and now_s - self.since_s > limits.body_s:
            if self._received_bytes < BODY_BYTES:
                self._end(408, "The body of the request did not arrive in time.")
            else:
                self._enter(Phase.BODY)

    def abort(self) -> None:
        """Close the connection at once."""
        self.transport.abort()

    def _enter(self, phase: Phase) -> None:
        self._phase, self.since_s, self._received_bytes = phase, time.monotonic(), 0
        self._guard.enter(self)

    def _end(self, status: int, reason: str) -> None:
        """Answer a status if nothing was answered yet, and close the connection."""
        if self.cycle is None or self.cycle.response_complete or not self.cycle.response_started:
            text = reason.encode("ascii")
            head = b"content-type: text/plain; charset=utf-8\r\nconnection: close\r\ncontent-length: %d\r\n\r\n"
            self.transport.write(STATUS_LINE[status] + head % len(text) + text)
        self.transport.close()
