"""Many clients of an event stream in a process of their own, which notes when each of them received which event."""

from __future__ import annotations

import asyncio
import sys
import time
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np

CONNECTING_AT_ONCE = 20


class StreamClient(asyncio.Protocol):
    """A client that notes only the newest event of what arrives, so that 500 of them leave the machine to the service.

    Parameters
    ----------
    request
        The HTTP request that opens the stream.
    """

    def __init__(self, request: bytes) -> None:
        self.received: list[tuple[float, int]] = []
        """Pairs of a time, s, and the newest event that had arrived by then."""
        self.began = asyncio.get_running_loop().create_future()
        self._request = request
        self._rest = b""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Send the request."""
        assert isinstance(transport, asyncio.Transport)
        transport.write(self._request)

    def data_received(self, data: bytes) -> None:
        """Note the newest whole event."""
        now_s = time.monotonic()
        whole, end, rest = (self._rest + data).rpartition(b"\n\n")
        self._rest = rest if end else self._rest + data
        start = whole.rfind(b"\nid: ")
        if start >= 0:
            self.received.append((now_s, int(whole[start + 5 :].split(b"\n", 1)[0])))
            if not self.began.done():
                self.began.set_result(None)


async def listen(url: str, key: str, path: str, count: int, file: Path) -> None:
    """Open `count` streams, print a line once all have begun, and write what they received when the input ends."""
    address = urlsplit(url)
    host, port = str(address.hostname), int(address.port or 80)
    lines = (f"GET {path} HTTP/1.1", f"Host: {address.netloc}", f"Authorization: Bearer {key}", "", "")
    loop, opening = asyncio.get_running_loop(), asyncio.Semaphore(CONNECTING_AT_ONCE)

    async def connect() -> StreamClient:
        async with opening:
            request = "\r\n".join(lines).encode()
            _, client = await loop.create_connection(lambda: StreamClient(request), host, port)
            await client.began
            return client

    clients = await asyncio.gather(*(connect() for _ in range(count)))
    print("all have begun", flush=True)
    await asyncio.to_thread(sys.stdin.read)
    rows = [(number, *seen) for number, client in enumerate(clients) for seen in client.received]
    np.save(file, np.array(rows))


if __name__ == "__main__":
    of, with_key, at, number, target = sys.argv[1:]
    asyncio.run(listen(of, with_key, at, int(number), Path(target)))
