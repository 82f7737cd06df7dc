"""The count of the messages of the broker that this worker did not accept: orders, stop signals and leases."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import structlog

LOG_S = 10.0
"""The interval at which the log says how many messages were refused."""
HELD_S = 1.0
"""The time after which the process that holds the lock is taken for dead: it holds it for microseconds."""

log = structlog.get_logger()


class Refusals:
    """Counts refused messages. Pool processes inherit it, and they count together with the worker."""

    def __init__(self, *, steady: Callable[[], float] = time.monotonic) -> None:
        self._lock = multiprocessing.Lock()
        self._is_lock_lost = False
        self._counted = multiprocessing.RawValue("Q", 0)
        self._logged_s = multiprocessing.RawValue("d", float("-inf"))
        self._steady = steady

    @property
    def count(self) -> int:
        """The number of refused messages since the worker started."""
        return int(self._counted.value)

    def record(self, reason: object) -> None:
        """Count a message, and log the reason unless one was logged a moment ago."""
        with self._alone():
            self._counted.value += 1
            now_s = self._steady()
            is_due = now_s - self._logged_s.value >= LOG_S
            if is_due:
                self._logged_s.value = now_s
        if is_due:
            log.warning("a message of the broker was refused", refused=self.count, reason=str(reason)[:500])

    @contextmanager
    def _alone(self) -> Iterator[None]:
        """Keep the other processes from counting, as long as none of them was killed while it did so.

        The lock is then never free again. Without it the count may miss a message, but no process waits.
        """
        is_held = not self._is_lock_lost and self._lock.acquire(timeout=HELD_S)
        self._is_lock_lost = not is_held
        try:
            yield
        finally:
            if is_held:
                self._lock.release()


refusals = Refusals()
"""The count of this worker. It exists before the pool processes are forked."""
