"""Clients that mean harm, in a process of their own: slow headers, half requests, a flood, and expensive pictures."""

from __future__ import annotations

import asyncio
import sys
import time
from collections.abc import Awaitable, Callable
from contextlib import suppress
from urllib.parse import urlsplit

ADDRESS = "127.0.0.2"
"""The address of these clients, which is not that of the healthy one."""
SLOW, HALF, FLOODS, VIEWERS = 200, 1200, 2, 8
"""The numbers of connections of each kind."""
SETTLE_S = 3.0
_Connection = tuple[asyncio.StreamReader, asyncio.StreamWriter]


async def attack(url: str, key: str, job_id: str) -> None:
    """Do harm until the input ends; print a line once it has begun."""
    address = urlsplit(url)

    async def connect() -> _Connection:
        return await asyncio.open_connection(address.hostname, address.port, local_addr=(ADDRESS, 0))

    head = f"Host: {address.netloc}\r\n"
    picture = f"/api/v1/jobs/{job_id}/frames/1/observer?rays=256&size=1024"
    view = f"GET {picture}&x=%d HTTP/1.1\r\n{head}Authorization: Bearer {key}\r\n\r\n"
    flood, pictures = [0], [0]
    kinds: tuple[tuple[int, Callable[[_Connection], Awaitable[None]]], ...] = (
        (SLOW, _send_slowly),
        (HALF, _send_half),
        (FLOODS, lambda one: _ask_on(one, f"GET /api/v1/jobs HTTP/1.1\r\n{head}\r\n", flood)),
        (VIEWERS, lambda one: _ask_on(one, view, pictures)),
    )
    tasks = [asyncio.create_task(_again(connect, kind)) for count, kind in kinds for _ in range(count)]
    await asyncio.sleep(SETTLE_S)
    print("all have begun", flush=True)
    begun_s, begun = time.monotonic(), (flood[0], pictures[0])
    await asyncio.to_thread(sys.stdin.read)
    lasted_s = time.monotonic() - begun_s
    rates = [(now - was) / lasted_s for now, was in zip((flood[0], pictures[0]), begun, strict=True)]
    print(f"{rates[0]:.0f} answers/s to the flood, {rates[1]:.1f}/s to the viewers", flush=True)
    for task in tasks:
        task.cancel()


async def _again(connect: Callable[[], Awaitable[_Connection]], kind: Callable[[_Connection], Awaitable[None]]) -> None:
    """Open a connection whenever the one before has ended."""
    while True:
        with suppress(OSError, EOFError, ValueError):
            connection = await connect()
            try:
                await kind(connection)
            finally:
                connection[1].close()
        await asyncio.sleep(0.2)


async def _send_slowly(connection: _Connection) -> None:
    while not connection[0].at_eof():
        connection[1].write(b"G")
        await connection[1].drain()
        await asyncio.sleep(1.0)


async def _send_half(connection: _Connection) -> None:
    connection[1].write(b"POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Le")
    await connection[0].read()


async def _ask_on(connection: _Connection, request: str, answered: list[int]) -> None:
    """Ask for the next answer as soon as there is one, and count them."""
    reader, writer = connection
    for number in range(10**9):
        writer.write((request.replace("%d", str(number % 50))).encode())
        head = (await reader.readuntil(b"\r\n\r\n")).lower()
        await reader.readexactly(int(head.partition(b"content-length: ")[2].split(b"\r\n")[0]))
        answered[0] += 1


if __name__ == "__main__":
    asyncio.run(attack(*sys.argv[1:]))
