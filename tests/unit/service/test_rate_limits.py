"""The rates of requests."""

from __future__ import annotations

import asyncio
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.errors import TooManyRequests
from service.rate_limits import MOST_COUNTERS, RateLimit
from tests.minutes import stop_minutes


@settings(max_examples=50)
@given(st.lists(st.floats(0.0, 30.0), max_size=60), st.integers(1, 20))
def test_no_minute_has_more_requests_than_two_allowances(pauses: list[float], per_minute: int) -> None:
    async def run() -> list[float]:
        limit, allowed = RateLimit(per_minute), []
        for pause_s in pauses:
            clock.now_s += pause_s
            if await limit.count("a"):
                allowed.append(clock.now_s)
        return allowed

    with pytest.MonkeyPatch.context() as patch:
        clock = stop_minutes(patch)
        allowed = asyncio.run(run())
    for begin_s in allowed:
        assert sum(begin_s <= at_s < begin_s + 60 for at_s in allowed) <= 2 * per_minute


@pytest.mark.parametrize("begin_s", [0.0, 20.0, 58.0])
def test_an_allowance_may_come_at_once_and_the_next_request_after_the_wait(
    monkeypatch: pytest.MonkeyPatch, begin_s: float
) -> None:
    clock = stop_minutes(monkeypatch)

    async def run() -> None:
        limit = RateLimit(6)
        clock.now_s += begin_s
        for _ in range(6):
            await limit.check("a", "slower")
        for _ in range(20):
            with pytest.raises(TooManyRequests, match="slower") as refused:
                await limit.check("a", "slower")
            wait_s = refused.value.retry_after_s
            assert 0 < wait_s <= 60
            clock.now_s += wait_s - 0.01
            assert await limit.wait_s("a") > 0
            clock.now_s += 0.02
            await limit.check("a", "slower")
        await limit.check("b", "slower")

    asyncio.run(run())


def test_what_is_remembered_of_clients_is_bounded_and_ends_with_their_minutes(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = stop_minutes(monkeypatch)
    threads = threading.active_count()

    async def run() -> None:
        limit = RateLimit(1)
        for number in range(2 * MOST_COUNTERS):
            await limit.check(str(number), "slower")
        assert await limit.wait_s(str(number)) > 0
        storage = limit._limiter.storage
        remembered = [storage.storage, storage.expirations, storage.locks]  # type: ignore[attr-defined]
        assert all(MOST_COUNTERS / 2 < len(one) <= MOST_COUNTERS for one in remembered)
        clock.now_s += 121
        await limit.check("new", "slower")
        await asyncio.sleep(0)
        assert [len(one) for one in remembered] == [1, 1, 1]

    asyncio.run(run())
    assert threading.active_count() == threads
