"""Silence means something only while the clerk hears."""

from __future__ import annotations

import pytest

from service.coordinator.liveness import Liveness

GAP_S = 15.0


class Ear:
    """A hearing, and two clocks that the test moves."""

    def __init__(self) -> None:
        self.wall_s, self.steady_s = 1000.0, 50.0
        self.hearing = Liveness(gap_s=GAP_S, clock=lambda: self.wall_s, steady=lambda: self.steady_s)

    def wait(self, seconds: float) -> None:
        self.wall_s += seconds
        self.steady_s += seconds

    def listen(self, seconds: int, *, caught_up: bool = True) -> None:
        for _ in range(seconds):
            self.wait(1)
            self.hearing.record_round(caught_up=caught_up)

    def since_s(self) -> float | None:
        return self.hearing.since_s()


def test_who_never_heard_hears_nothing_and_then_since_the_first_round() -> None:
    ear = Ear()
    assert ear.since_s() is None
    ear.listen(100)
    assert ear.since_s() == 1001.0


def test_a_gap_means_nothing_is_heard_and_since_starts_anew() -> None:
    ear = Ear()
    ear.listen(10)
    ear.wait(GAP_S)
    assert ear.since_s() == 1001.0
    ear.wait(0.1)
    assert ear.since_s() is None
    ear.hearing.record_round(caught_up=True)
    assert ear.since_s() == ear.wall_s


@pytest.mark.parametrize("step_s", [3600.0, 50.0, -50.0])
def test_a_clock_that_is_set_and_a_machine_that_slept_are_gaps(step_s: float) -> None:
    ear = Ear()
    ear.listen(10)
    ear.wall_s += step_s
    assert ear.since_s() is None
    ear.hearing.record_round(caught_up=True)
    assert ear.since_s() == ear.wall_s


def test_a_round_that_failed_is_a_gap() -> None:
    ear = Ear()
    ear.listen(10)
    ear.hearing.record_gap()
    assert ear.since_s() is None
    ear.listen(1)
    assert ear.since_s() == ear.wall_s


def test_who_is_behind_hears_nothing_until_it_has_caught_up_and_since_stays() -> None:
    ear = Ear()
    ear.listen(10)
    ear.listen(60, caught_up=False)
    assert ear.since_s() is None
    ear.listen(1)
    assert ear.since_s() == 1001.0


def test_since_does_not_begin_while_behind() -> None:
    ear = Ear()
    ear.listen(10, caught_up=False)
    assert ear.since_s() is None
    ear.listen(1)
    assert ear.since_s() == ear.wall_s
