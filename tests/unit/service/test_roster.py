"""Requests know the workers that are online, and do not wait for a broker that is away."""

from __future__ import annotations

from lippmann.job.messages.events import Presence
from service.broker_stream import Stream
from service.errors import BrokerUnavailable
from service.roster import AWAY_S, FRESH_S, RosterCache
from tests.builders_service import T0, presence


class Asked(Stream):
    """A stream that counts the questions, of a broker that the test takes away."""

    def __init__(self) -> None:
        self.workers: tuple[Presence, ...] | None = (presence("w1"),)
        self.questions = 0

    def presences(self) -> tuple[Presence, ...]:
        self.questions += 1
        if self.workers is None:
            raise BrokerUnavailable("away")
        return self.workers

    def not_claiming(self) -> dict[str, float]:
        return {"w2": T0}


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_a_roster_is_asked_for_once_as_long_as_it_is_fresh() -> None:
    stream, clock = Asked(), Clock()
    cache = RosterCache(stream, steady=clock)
    first = cache.latest()
    assert first is not None
    assert [worker.name for worker in first.present] == ["w1"]
    stream.workers = (presence("w1"), presence("w2"))
    assert cache.latest() is first
    clock.now_s = FRESH_S
    second = cache.latest()
    assert second is not None
    assert ([worker.name for worker in second.present], [worker.name for worker in second.claiming]) == (
        ["w1", "w2"],
        ["w1"],
    )
    assert (second.slots, stream.questions) == (2, 2)


def test_a_broker_that_is_away_is_not_asked_by_every_request() -> None:
    stream, clock = Asked(), Clock()
    stream.workers = None
    cache = RosterCache(stream, steady=clock)
    assert [cache.latest() for _ in range(5)] == [None] * 5
    clock.now_s = AWAY_S - 0.1
    assert cache.latest() is None
    assert stream.questions == 1
    stream.workers = ()
    clock.now_s = AWAY_S
    roster = cache.latest()
    assert roster is not None
    assert roster.present == ()
