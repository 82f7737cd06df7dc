"""The queue of pictures that are made on demand. Each takes a core for a while, and its time is charged to its key.

The next picture is of the key that has been charged least, so a viewer who asks for many or for expensive pictures
waits behind the others (start-time fair queueing, Goyal et al. 1996). The queue is bounded, in all and by key, and a
key has a budget of seconds a minute.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from typing import TypeVar

import anyio

from service.errors import TooManyRequests
from service.limits import Limit

AT_ONCE = 2
"""The number of pictures that are made at once. Each takes a core and several times its size in memory."""
WAITING = 400
"""The largest number of pictures that wait."""
WAITING_BY_KEY = 100
"""The largest number of pictures of one key that wait; a page of thumbnails asks for dozens."""
EXPECTED_S = 0.1
"""The time that is charged for a picture until its own is known."""
RETRY_S = 2.0
BUDGET_S = 60.0
"""The time over which the budget of a key is spread; a key that has rested may use this much of it at once."""
PRUNED_AT = 1000

T = TypeVar("T")


class PictureQueue:
    """Has pictures made, a few at once, by threads that wait for the processes that make them."""

    def __init__(self, *, at_once: int = AT_ONCE, waiting: int = WAITING, by_key: int = WAITING_BY_KEY) -> None:
        self._limits = (waiting, by_key)
        self._free = at_once
        self._places = anyio.CapacityLimiter(at_once)
        self._threads = ThreadPoolExecutor(at_once, "picture")
        self._waiting: dict[str, deque[asyncio.Future[None]]] = {}
        self._charged_s: dict[str, float] = {}
        self._virtual_s = 0.0
        """The charge of the key that was served last; a key that comes later starts from there."""
        self._paid_s: dict[str, float] = {}
        """The time, of a clock that is never set, at which a key has its whole budget again."""

    async def run(self, key: str, make: Callable[[], T], *, budget: Limit) -> T:
        """Return what `make` returns, which runs in a thread when it is the turn of the key.

        Parameters
        ----------
        budget
            The seconds a minute for which pictures of the key may be made.

        Raises
        ------
        TooManyRequests
            If too many pictures wait, or if the key has used up its budget. A picture that has begun is made.
        """
        self._check_budget(key, budget)
        await self._turn(key)
        begun_s = time.monotonic()
        try:
            self._check_budget(key, budget)  # other pictures of the key were made while this one waited
            made = self._threads.submit(copy_context().run, make)
            return await anyio.to_thread.run_sync(made.result, limiter=self._places)
        finally:
            used_s = time.monotonic() - begun_s
            self._charge(key, used_s - EXPECTED_S)
            self._pay(key, used_s, budget)
            self._free += 1
            self._serve()

    def _check_budget(self, key: str, budget: Limit) -> None:
        wait_s = self._paid_s.get(key, 0.0) - time.monotonic() - BUDGET_S
        if wait_s > 0:
            message = f"pictures of this key took more seconds a minute than allowed, expected {budget}"
            raise TooManyRequests(message, retry_after_s=wait_s)

    def _pay(self, key: str, used_s: float, budget: Limit) -> None:
        now_s = time.monotonic()
        self._paid_s[key] = max(now_s, self._paid_s.get(key, now_s)) + used_s * BUDGET_S / budget.value
        if len(self._paid_s) > PRUNED_AT:
            self._paid_s = {one: paid_s for one, paid_s in self._paid_s.items() if paid_s > now_s}

    async def _turn(self, key: str) -> None:
        waiting, by_key = self._limits
        mine = self._waiting.get(key, ())
        if len(mine) >= by_key or sum(map(len, self._waiting.values())) >= waiting:
            raise TooManyRequests("too many pictures wait to be made", retry_after_s=RETRY_S)
        turn: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting.setdefault(key, deque()).append(turn)
        self._serve()
        try:
            await turn
        except asyncio.CancelledError:
            if turn.done() and not turn.cancelled():  # the turn came at the moment at which the client left
                self._free += 1
                self._serve()
            raise

    def _serve(self) -> None:
        while self._free and self._waiting:
            key = min(self._waiting, key=self._begins_s)
            turn = self._waiting[key].popleft()
            if not self._waiting[key]:
                del self._waiting[key]
            if turn.cancelled():
                continue
            self._free -= 1
            self._virtual_s = self._begins_s(key)
            self._charge(key, EXPECTED_S)
            turn.set_result(None)

    def _begins_s(self, key: str) -> float:
        return max(self._virtual_s, self._charged_s.get(key, 0.0))

    def _charge(self, key: str, seconds: float) -> None:
        self._charged_s[key] = self._begins_s(key) + seconds
        if len(self._charged_s) > PRUNED_AT:
            self._charged_s = {one: used_s for one, used_s in self._charged_s.items() if used_s > self._virtual_s}
