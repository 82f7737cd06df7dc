"""The rates of requests: by key, by address, and of failed logins.

Each process of the service counts by itself and in memory, since no request may wait for the broker.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from limits import RateLimitItemPerMinute
from limits.aio.storage import MemoryStorage
from limits.aio.strategies import SlidingWindowCounterRateLimiter

from service.errors import TooManyRequests

MOST_COUNTERS = 4_096
"""The largest number of counters of one rate. A client has one for this minute and one for the minute before."""


class RateLimit:
    """Allows each client a number of requests a minute, which may come at once.

    It counts in the event loop, where no two requests count at the same time.
    """

    def __init__(self, per_minute: int) -> None:
        self._allowance = RateLimitItemPerMinute(per_minute)
        self._limiter = SlidingWindowCounterRateLimiter(_BoundedStorage())

    async def wait_s(self, client: str) -> float:
        """Return the time after which the client may send its next request; 0 if it may now."""
        if await self._limiter.test(self._allowance, client):
            return 0.0
        stats = await self._limiter.get_window_stats(self._allowance, client)
        return max(0.0, stats.reset_time - time.time())

    async def count(self, client: str) -> bool:
        """Count a request if the client may send one now, and return whether it may."""
        return await self._limiter.hit(self._allowance, client)

    async def check(self, client: str, message: str) -> None:
        """Count a request that the client may send now.

        Raises
        ------
        TooManyRequests
            If the client must wait; the request is not counted.
        """
        if not await self.count(client):
            raise TooManyRequests(message, retry_after_s=await self.wait_s(client))


class _BoundedStorage(MemoryStorage):
    """Counters in memory, of which the oldest are forgotten when there are too many.

    The library forgets counters that have expired, but keeps one for each address that asks within two minutes.
    """

    async def incr(self, key: str, expiry: float, amount: int = 1) -> int:
        """Increase a counter, and make room for a new one."""
        if key not in self.storage and len(self.storage) >= MOST_COUNTERS:
            for oldest in list(self.storage)[: MOST_COUNTERS // 8]:
                await self.clear(oldest)
        return await super().incr(key, expiry, amount)


@dataclass(frozen=True)
class RateLimits:
    """The rates of one process."""

    by_key: RateLimit
    by_address: RateLimit
    failed_logins: RateLimit

    async def check_login(self, address: str) -> None:
        """Raise TooManyRequests if too many logins from an address have failed."""
        wait_s = await self.failed_logins.wait_s(address)
        if wait_s > 0:
            raise TooManyRequests("too many logins from this address have failed", retry_after_s=wait_s)
