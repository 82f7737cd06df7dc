"""The rates of requests: by key, by address, and of failed logins.

Each process of the service counts by itself and in memory, since no request may wait for the broker.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

from service.errors import TooManyRequests

PRUNED_AT = 10_000
"""The number of remembered clients at which those are forgotten that have been quiet for long enough."""


class RateLimit:
    """Allows each client a number of requests a minute, which may come at once.

    It is the generic cell rate algorithm (ITU-T I.371): one number a client, the time at which it has used up nothing.
    """

    def __init__(self, per_minute: float, *, steady: Callable[[], float] = time.monotonic) -> None:
        self._interval_s = 60.0 / per_minute
        self._steady = steady
        self._free_s: dict[str, float] = {}

    def wait_s(self, client: str) -> float:
        """Return the time after which the client may send its next request; 0 if it may now."""
        now_s = self._steady()
        return max(0.0, self._free_s.get(client, now_s) + self._interval_s - now_s - 60.0)

    def count(self, client: str) -> None:
        """Count a request."""
        now_s = self._steady()
        if client not in self._free_s and len(self._free_s) >= PRUNED_AT:
            self._free_s = {one: free_s for one, free_s in self._free_s.items() if free_s > now_s}
        self._free_s[client] = max(now_s, self._free_s.get(client, now_s)) + self._interval_s

    def check(self, client: str, message: str) -> None:
        """Count a request that the client may send now.

        Raises
        ------
        TooManyRequests
            If the client must wait; the request is not counted.
        """
        wait_s = self.wait_s(client)
        if wait_s > 0:
            raise TooManyRequests(message, retry_after_s=wait_s)
        self.count(client)


@dataclass(frozen=True)
class RateLimits:
    """The rates of one process."""

    by_key: RateLimit
    by_address: RateLimit
    failed_logins: RateLimit

    def check_login(self, address: str) -> None:
        """Raise TooManyRequests if too many logins from an address have failed."""
        wait_s = self.failed_logins.wait_s(address)
        if wait_s > 0:
            raise TooManyRequests("too many logins from this address have failed", retry_after_s=wait_s)
