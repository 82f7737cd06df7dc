"""The count of the messages of the broker that this worker did not accept: orders, stop signals and leases."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable

import structlog

LOG_S = 10.0
"""The interval at which the log says how many messages were refused."""

log = structlog.get_logger()


class Refusals:
    """Counts refused messages. Pool processes inherit it, and they count together with the worker."""

    def __init__(self, *, steady: Callable[[], float] = time.monotonic) -> None:
        self._counted = multiprocessing.Value("Q", 0)
        self._logged_s = multiprocessing.Value("d", float("-inf"))
        self._steady = steady

    @property
    def count(self) -> int:
        """The number of refused messages since the worker started."""
        return int(self._counted.value)

    def record(self, reason: object) -> None:
        """Count a message, and log the reason unless one was logged a moment ago."""
        with self._counted.get_lock():
            self._counted.value += 1
        now_s = self._steady()
        with self._logged_s.get_lock():
            if now_s - self._logged_s.value < LOG_S:
                return
            self._logged_s.value = now_s
        log.warning("a message of the broker was refused", refused=self.count, reason=str(reason)[:500])


refusals = Refusals()
"""The count of this worker. It exists before the pool processes are forked."""
