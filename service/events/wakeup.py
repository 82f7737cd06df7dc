"""Wakes the threads of the coordinator and the event hub after a change.

It only shortens the wait. All of them also poll, so nothing depends on it.
"""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Wakeup:
    """A signal to threads and event loops."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._threads: set[threading.Event] = set()
        self._loops: set[tuple[asyncio.AbstractEventLoop, asyncio.Event]] = set()

    def notify(self) -> None:
        """Wake all waiting threads and coroutines."""
        with self._lock:
            threads = list(self._threads)
        for waiter in threads:
            waiter.set()
        self.notify_coroutines()

    def notify_coroutines(self) -> None:
        """Wake all waiting coroutines."""
        with self._lock:
            loops = list(self._loops)
        for loop, woken in loops:
            if not loop.is_closed():
                loop.call_soon_threadsafe(woken.set)

    @contextmanager
    def for_thread(self) -> Iterator[threading.Event]:
        """Provide an event that `notify` sets, for a thread."""
        waiter = threading.Event()
        with self._lock:
            self._threads.add(waiter)
        try:
            yield waiter
        finally:
            with self._lock:
                self._threads.discard(waiter)

    @contextmanager
    def for_coroutine(self) -> Iterator[asyncio.Event]:
        """Provide an event that `notify` sets, for a coroutine of the running loop."""
        entry = (asyncio.get_running_loop(), asyncio.Event())
        with self._lock:
            self._loops.add(entry)
        try:
            yield entry[1]
        finally:
            with self._lock:
                self._loops.discard(entry)
