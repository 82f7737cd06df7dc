"""The rates of requests."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.errors import TooManyRequests
from service.rate_limits import PRUNED_AT, RateLimit


class Clock:
    now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


@settings(max_examples=50)
@given(st.lists(st.floats(0.0, 30.0), max_size=60), st.integers(1, 20))
def test_no_minute_has_more_requests_than_two_allowances(pauses: list[float], per_minute: int) -> None:
    clock = Clock()
    limit, allowed = RateLimit(per_minute, steady=clock), []
    for pause_s in pauses:
        clock.now_s += pause_s
        if limit.wait_s("a") == 0:
            limit.count("a")
            allowed.append(clock.now_s)
    for begin_s in allowed:
        assert sum(begin_s <= at_s < begin_s + 60 for at_s in allowed) <= 2 * per_minute


def test_an_allowance_may_come_at_once_and_the_next_request_waits_for_its_share() -> None:
    clock = Clock()
    limit = RateLimit(6, steady=clock)
    for _ in range(6):
        limit.check("a", "slower")
    with pytest.raises(TooManyRequests) as refused:
        limit.check("a", "slower")
    assert refused.value.retry_after_s == pytest.approx(10.0)
    limit.check("b", "slower")
    clock.now_s += 10.0
    limit.check("a", "slower")
    assert limit.wait_s("a") > 0


def test_clients_that_have_been_quiet_are_forgotten() -> None:
    clock = Clock()
    limit = RateLimit(60, steady=clock)
    for number in range(PRUNED_AT):
        limit.count(str(number))
    clock.now_s += 2.0
    limit.count("new")
    assert list(limit._free_s) == ["new"]
