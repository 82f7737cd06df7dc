"""The rates of requests: by key, by address, and of failed logins; and the brake of answers that refuse a request.

Each process of the service counts by itself and in memory, since no request may wait for the broker.
"""

from __future__ import annotations

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from limits import RateLimitItemPerMinute
from limits.aio.storage import MemoryStorage
from limits.aio.strategies import SlidingWindowCounterRateLimiter

from service.errors import TooManyRequests
from service.instruments import Refusal, count_refusal

MOST_COUNTERS = 4_096
"""The largest number of counters of one rate. A client has one for this minute and one for the minute before."""

REFUSALS_AT_ONCE = 200
"""The number of refusals that an address gets at once; a page or a script with an old key soon gives up."""
REFUSED_SHARE = 0.03
"""The rate of the refusals that an address gets after these, in parts of the rate of its requests."""
LONGEST_WAIT_S = 10.0
"""The longest time for which a refusal is held back."""
MOST_HELD = 256
"""The largest number of refusals that are held back at the same time. Each of them takes a connection and memory."""


class RateLimit:
    """Allows each client a number of requests a minute, which may come at once.

    It counts in the event loop, where no two requests count at the same time.

    Parameters
    ----------
    counted_as
        The name of the rate in the figures of this process.
    """

    def __init__(self, per_minute: int, *, counted_as: Refusal = Refusal.KEY) -> None:
        self.per_minute = per_minute
        self.counted_as = counted_as
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
            count_refusal(self.counted_as)
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


class RefusalBrake:
    """Holds refusals back from addresses that cause many, so that a flood of requests becomes as slow as its answers.

    A client that waits for each answer, on however many connections, then costs the service next to nothing.

    Parameters
    ----------
    per_minute
        The number of requests a minute that an address may send.
    """

    def __init__(self, per_minute: int, *, steady: Callable[[], float] = time.monotonic) -> None:
        self._pause_s = 60 / (per_minute * REFUSED_SHARE)
        self._steady = steady
        self._held = 0
        self._paid_s: dict[str, float] = {}
        """The time until which an address has used up its refusals."""

    def wait_s(self, address: str) -> float:
        """Count a refusal, and return the time for which it is to be held back."""
        now_s = self._steady()
        if len(self._paid_s) >= MOST_COUNTERS:
            self._paid_s = {one: paid_s for one, paid_s in self._paid_s.items() if paid_s > now_s}
        paid_s = max(now_s, self._paid_s.get(address, now_s)) + self._pause_s
        wait_s = paid_s - now_s - REFUSALS_AT_ONCE * self._pause_s
        if wait_s <= LONGEST_WAIT_S:
            self._paid_s[address] = paid_s
        return min(max(0.0, wait_s), LONGEST_WAIT_S)

    async def hold_back(self, address: str, wait: Callable[[float], Awaitable[None]]) -> None:
        """Wait for as long as a refusal is held back: not at all if too many are."""
        wait_s = self.wait_s(address)
        if wait_s <= 0 or self._held >= MOST_HELD:
            return
        self._held += 1
        try:
            await wait(wait_s)
        finally:
            self._held -= 1


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
            count_refusal(Refusal.LOGIN)
            raise TooManyRequests("too many logins from this address have failed", retry_after_s=wait_s)
