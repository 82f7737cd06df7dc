"""Connections whose refusals are held back: what ends the wait, and who gets in meanwhile."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from typing import Any, cast

import pytest
import uvicorn
from starlette.types import Receive, Scope, Send

from service.connections import ConnectionGuard, ConnectionLimits, GuardedProtocol, Phase
from service.rate_limits import RateLimit
from service.routes.middleware import AddressRate
from tests.waiting import ENOUGH_S

HELD_S = 2 * ENOUGH_S
"""The time for which each refusal is held back here, which no test waits for."""
SOON_S = 60.0
Stream = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def application(scope: Scope, _receive: Receive, send: Send) -> None:
    """Answer one path, and refuse all others."""
    status = 200 if scope["path"] == "/open" else 401
    await send({"type": "http.response.start", "status": status, "headers": [(b"content-length", b"0")]})
    await send({"type": "http.response.body", "body": b""})


class Running:
    """A server that listens in this event loop."""

    def __init__(self, *, most: int) -> None:
        limits = ConnectionLimits(total=most, by_address=most, headers_s=ENOUGH_S, body_s=ENOUGH_S)
        self.guard = ConnectionGuard(limits)
        app, protocol = AddressRate(application, rate=RateLimit(100)), cast(Any, self.guard.protocol)
        self.server = uvicorn.Server(uvicorn.Config(app, http=protocol, ws="none", lifespan="off", log_config=None))
        self.socket = socket.create_server(("127.0.0.1", 0))
        self.address = self.socket.getsockname()
        self.clients: list[asyncio.StreamWriter] = []

    async def connect(self, path: str = "") -> Stream:
        """Connect, and ask for a path."""
        reader, writer = await asyncio.open_connection(*self.address)
        self.clients.append(writer)
        if path:
            ask(writer, path)
        return reader, writer

    async def held(self, count: int) -> list[GuardedProtocol]:
        """Wait until a number of connections is held back, and return them."""
        return await self.until(lambda: self._all_held(count))

    async def until(self, condition: Callable[[], list[GuardedProtocol] | bool]) -> list[GuardedProtocol]:
        """Wait for a condition, and return its value."""
        async with asyncio.timeout(SOON_S):
            while not (value := condition()):
                await asyncio.sleep(0.005)
        return value if isinstance(value, list) else []

    def _all_held(self, count: int) -> list[GuardedProtocol]:
        held = [one for one in self.guard._all if one.phase is Phase.HELD]
        return held if len(held) == count else []


def ask(writer: asyncio.StreamWriter, path: str) -> None:
    writer.write(f"GET {path} HTTP/1.1\r\nHost: x\r\n\r\n".encode())


async def status(stream: Stream) -> bytes:
    """Return the status line of an answer."""
    return (await asyncio.wait_for(stream[0].readuntil(b"\r\n\r\n"), SOON_S)).split(b"\r\n")[0]


@asynccontextmanager
async def running(*, most: int = 100) -> AsyncIterator[Running]:
    run = Running(most=most)
    serving = asyncio.create_task(run.server.serve(sockets=[run.socket]))
    await run.until(lambda: run.server.started)
    try:
        yield run
    finally:
        run.server.should_exit = True
        await asyncio.wait_for(serving, SOON_S)
        for client in run.clients:
            client.close()


@pytest.fixture
def serve(monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[], Awaitable[None]]], None]:
    for name, value in {"REFUSALS_AT_ONCE": 0, "REFUSED_SHARE": 1e-5, "LONGEST_WAIT_S": HELD_S}.items():
        monkeypatch.setattr(f"service.rate_limits.{name}", value)

    async def limited(test: Callable[[], Awaitable[None]]) -> None:
        await asyncio.wait_for(test(), ENOUGH_S)

    return lambda test: asyncio.run(limited(test))


Serve = Callable[[Callable[[], Awaitable[None]]], None]


def test_a_client_that_leaves_is_held_back_no_longer(serve: Serve) -> None:
    async def test() -> None:
        async with running() as run:
            _, writer = await run.connect("/refused")
            await run.held(1)
            writer.close()
            await run.until(lambda: not run.server.server_state.tasks)

    serve(test)


def test_a_server_that_stops_waits_for_no_answer_that_is_held_back(serve: Serve) -> None:
    async def test() -> None:
        async with running() as run:
            refused = await run.connect("/refused")
            await run.held(1)
            answer = asyncio.create_task(status(refused))
        assert await answer == b"HTTP/1.1 401 Unauthorized"

    serve(test)


@pytest.mark.promise("Before login", "Refusals that are held back keep nobody else out.")
def test_an_honest_client_takes_the_place_of_a_refusal_that_is_held_back(serve: Serve) -> None:
    async def test() -> None:
        async with running(most=2) as run:
            idle, refused = await run.connect(), await run.connect("/refused")
            (held,) = await run.held(1)
            ask(refused[1], "/refused")  # It waits for another answer, too, which changes nothing.
            await run.until(lambda: bool(held.pipeline))
            honest = await run.connect("/open")
            assert await status(honest) == b"HTTP/1.1 200 OK"
            with suppress(ConnectionResetError):
                assert await asyncio.wait_for(refused[0].read(), SOON_S) == b""
            ask(idle[1], "/open")
            assert await status(idle) == b"HTTP/1.1 200 OK"
            assert run.guard.closed == 1

    serve(test)
