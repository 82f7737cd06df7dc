"""The rates of requests."""

from __future__ import annotations

import asyncio
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.errors import TooManyRequests
from service.rate_limits import (
    LONGEST_WAIT_S,
    MOST_COUNTERS,
    MOST_HELD,
    REFUSALS_AT_ONCE,
    REFUSED_SHARE,
    RateLimit,
    RefusalBrake,
)
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


def test_refusals_come_at_once_until_they_are_many_and_then_at_their_rate() -> None:
    now_s = [0.0]
    brake = RefusalBrake(40_000, steady=lambda: now_s[0])
    assert max(brake.wait_s("a") for _ in range(REFUSALS_AT_ONCE)) < 1e-9
    answered = 0
    while now_s[0] < 60.0:  # one client that waits for each answer
        now_s[0] += brake.wait_s("a") + 1e-3
        answered += 1
    assert answered == pytest.approx(40_000 * REFUSED_SHARE, rel=0.05)
    assert brake.wait_s("b") == 0.0
    now_s[0] += 60.0
    assert brake.wait_s("a") == 0.0


def test_no_refusal_is_held_back_for_longer_than_a_limit_and_what_is_remembered_is_bounded() -> None:
    now_s = [0.0]
    brake = RefusalBrake(60, steady=lambda: now_s[0])
    waits = [brake.wait_s("a") for _ in range(2 * REFUSALS_AT_ONCE)]
    assert max(waits) == LONGEST_WAIT_S
    now_s[0] += LONGEST_WAIT_S + 40.0
    assert brake.wait_s("a") < LONGEST_WAIT_S
    for number in range(3 * MOST_COUNTERS):
        brake.wait_s(str(number))
        now_s[0] += 60.0
    assert len(brake._paid_s) <= MOST_COUNTERS


def test_refusals_above_a_number_are_not_held_back_until_others_are_over() -> None:
    brake = RefusalBrake(60)

    async def run() -> None:
        over, waits = asyncio.Event(), list[float]()

        async def wait(seconds: float) -> None:
            waits.append(seconds)
            await over.wait()

        async with asyncio.TaskGroup() as group:
            for _ in range(REFUSALS_AT_ONCE):
                await brake.hold_back("a", wait)
            assert not waits
            for _ in range(MOST_HELD):
                group.create_task(brake.hold_back("a", wait))
            await asyncio.sleep(0)
            assert len(waits) == MOST_HELD
            await asyncio.wait_for(brake.hold_back("a", wait), 1.0)
            assert len(waits) == MOST_HELD
            over.set()
        await brake.hold_back("a", wait)
        assert len(waits) == MOST_HELD + 1

    asyncio.run(run())
