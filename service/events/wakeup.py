"""Wakes the clerk's threads and the listeners' streams when something was written.

Nothing depends on it: all of them also look by themselves.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Bell:
    """Rings in threads and event loops."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._threads: set[threading.Event] = set()
        self._streams: set[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = set()
        self.closed = False
        """Whether streams should end."""

    def ring(self) -> None:
        """Wake everyone."""
        with self._lock:
            threads, streams = list(self._threads), list(self._streams)
        for waiter in threads:
            waiter.set()
        for loop, woken in streams:
            if not loop.is_closed():
                loop.call_soon_threadsafe(woken.set)

    def close(self) -> None:
        """Ask every stream to end."""
        self.closed = True
        self.ring()

    @contextmanager
    def in_thread(self) -> Iterator[threading.Event]:
        """Lend an event that rings set."""
        waiter = threading.Event()
        with self._lock:
            self._threads.add(waiter)
        try:
            yield waiter
        finally:
            with self._lock:
                self._threads.discard(waiter)

    @contextmanager
    def in_stream(self) -> Iterator[asyncio.Event]:
        """Lend an event of the running loop that rings set."""
        entry = (asyncio.get_running_loop(), asyncio.Event())
        with self._lock:
            self._streams.add(entry)
        try:
            yield entry[1]
        finally:
            with self._lock:
                self._streams.discard(entry)
