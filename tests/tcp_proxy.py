"""A TCP proxy between a client and its broker, which a test cuts, delays and silences while it runs.

The proxy runs in a thread of its own, listens on a loopback port or on a Unix socket, and forwards to a port or to a
Unix socket. Each method changes the network for the connections that exist and for those that come:

pass_on      bytes travel in both directions, those that were held first
cut          every connection ends with a reset; new ones are accepted
refuse       every connection ends with a reset, and new ones are refused
delay        bytes travel later by a number of seconds
blackhole    bytes are held and connections stay open, in both directions or in one
abandon      existing connections stay open and silent for ever, as behind a firewall that forgot them; new ones work
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
import struct
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

from tests.waiting import ENOUGH_S

Address = tuple[str, int] | Path
"""A host and a port, or the path of a Unix socket."""
Direction = Literal["requests", "answers"]

CHUNK = 65_536
BOTH: tuple[Direction, Direction] = ("requests", "answers")


class _Link:
    """One connection of a client, and the connection to the upstream that belongs to it."""

    def __init__(self, client: asyncio.StreamWriter, upstream: asyncio.StreamWriter) -> None:
        self.is_abandoned = False
        self._writers = client, upstream
        # A TLS transport that has ended no longer knows its socket.
        self._sockets = [writer.get_extra_info("socket") for writer in self._writers]

    def reset(self) -> None:
        for writer, sock in zip(self._writers, self._sockets, strict=True):
            with contextlib.suppress(OSError):
                sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            writer.transport.abort()


class TcpProxy:
    """A proxy to an upstream; `address` is where clients connect."""

    def __init__(
        self, upstream: Address, *, listen: Address = ("127.0.0.1", 0), tls: ssl.SSLContext | None = None
    ) -> None:
        self.address = listen
        self._upstream = upstream
        self._tls = tls
        self._links: set[_Link] = set()
        self._delay_s = 0.0
        self._held: set[Direction] = set()
        self._server: asyncio.Server | None = None
        self._loop = asyncio.new_event_loop()
        self._changed = asyncio.Event()
        self._tasks: set[asyncio.Task[None]] = set()
        self._thread = threading.Thread(target=self._loop.run_forever, name="tcp-proxy", daemon=True)
        self._thread.start()
        self._call(self._listen)

    @property
    def connections(self) -> int:
        """The number of open connections."""
        return len(self._links)

    def pass_on(self) -> None:
        """Let bytes travel again, and accept new connections."""
        self._call(self._listen)
        self._set(delay_s=0.0, held=())

    def cut(self) -> None:
        """Reset every connection; new ones are accepted."""
        self._call(self._reset_all)

    def refuse(self) -> None:
        """Reset every connection, and refuse new ones."""
        self._call(self._stop_listening)
        self.cut()

    def delay(self, seconds: float) -> None:
        """Deliver bytes later."""
        self._set(delay_s=seconds, held=())

    def blackhole(self, *directions: Direction) -> None:
        """Hold all bytes, or those of one direction; connections stay open, and new ones are accepted."""
        self._set(delay_s=0.0, held=directions or BOTH)

    def abandon(self) -> None:
        """Keep the existing connections open and silent for ever; new ones work."""

        async def abandon() -> None:
            for link in self._links:
                link.is_abandoned = True

        self._call(abandon)

    def close(self) -> None:
        """End every connection and the proxy."""
        self.refuse()

        async def end() -> None:
            for task in self._tasks:
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)

        self._call(end)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(ENOUGH_S)
        self._loop.close()

    def _call(self, do: Callable[[], Any]) -> None:
        asyncio.run_coroutine_threadsafe(do(), self._loop).result(ENOUGH_S)

    def _set(self, *, delay_s: float, held: tuple[Direction, ...]) -> None:
        async def change() -> None:
            self._delay_s, self._held = delay_s, set(held)
            self._changed.set()
            self._changed.clear()

        self._call(change)

    async def _listen(self) -> None:
        if self._server is not None:
            return
        if isinstance(self.address, Path):
            self._server = await asyncio.start_unix_server(self._serve, self.address)
            return
        self._server = await asyncio.start_server(self._serve, *self.address, ssl=self._tls)
        self.address = self._server.sockets[0].getsockname()

    async def _stop_listening(self) -> None:
        if self._server is not None:
            self._server.close()
            self._server = None
        if isinstance(self.address, Path):
            self.address.unlink(missing_ok=True)

    async def _reset_all(self) -> None:
        for link in list(self._links):
            link.reset()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._tasks.add(task)
        try:
            up_reader, up_writer = await self._connect()
        except OSError:
            _Link(writer, writer).reset()
            self._tasks.discard(task)
            return
        link = _Link(writer, up_writer)
        self._links.add(link)
        try:
            await asyncio.gather(
                self._forward(link, reader, up_writer, "requests"), self._forward(link, up_reader, writer, "answers")
            )
        except (OSError, asyncio.CancelledError):
            pass  # one of the two ended the connection, or the proxy ends
        finally:
            link.reset()
            self._links.discard(link)
            self._tasks.discard(task)

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        if isinstance(self._upstream, Path):
            return await asyncio.open_unix_connection(self._upstream)
        return await asyncio.open_connection(*self._upstream)

    async def _forward(
        self, link: _Link, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, direction: Direction
    ) -> None:
        while True:
            data = await reader.read(CHUNK)
            await asyncio.sleep(self._delay_s)
            while link.is_abandoned or direction in self._held:
                await self._changed.wait()
            if not data:
                raise ConnectionResetError  # the end of one direction ends both
            writer.write(data)
            await writer.drain()


@contextmanager
def tcp_proxy(
    upstream: Address, *, listen: Address = ("127.0.0.1", 0), tls: ssl.SSLContext | None = None
) -> Iterator[TcpProxy]:
    """Run a proxy while the context lasts; with `tls` it ends the TLS of its clients."""
    proxy = TcpProxy(upstream, listen=listen, tls=tls)
    try:
        yield proxy
    finally:
        proxy.close()
