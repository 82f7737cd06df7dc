"""Silence means a lost attempt only while every event is read."""

from __future__ import annotations

import pytest

from service.coordinator.liveness import LONGEST_ROUND_S, RECOVERY_S, Liveness

SETTLED = int(RECOVERY_S) + 1
"""The rounds after which the clock has just not begun to run."""


class Probe:
    """A liveness, and two clocks that the test moves."""

    def __init__(self) -> None:
        self.wall_s, self.steady_s = 1000.0, 50.0
        self.liveness = Liveness(silence_s=45.0, clock=lambda: self.wall_s, steady=lambda: self.steady_s)

    def wait(self, seconds: float) -> None:
        self.wall_s += seconds
        self.steady_s += seconds

    def read(self, seconds: int, *, caught_up: bool = True) -> None:
        for _ in range(seconds):
            self.wait(1)
            self.liveness.record_round(caught_up=caught_up)

    def live_s(self) -> float | None:
        return self.liveness.live_s()


def test_the_clock_runs_once_the_workers_had_time_to_connect() -> None:
    probe = Probe()
    assert probe.live_s() is None
    probe.read(SETTLED)
    assert probe.live_s() == 0.0
    probe.read(100)
    assert probe.live_s() == 100.0
    assert probe.liveness.rounds == SETTLED + 100


def test_after_a_gap_the_clock_goes_on_where_it_stood() -> None:
    probe = Probe()
    probe.read(SETTLED + 7)
    probe.wait(LONGEST_ROUND_S)
    assert probe.live_s() == 7.0
    probe.wait(0.1)
    assert probe.live_s() is None
    probe.read(SETTLED)
    assert probe.live_s() == 7.0
    probe.read(1)
    assert probe.live_s() == 8.0


@pytest.mark.parametrize("step_s", [3600.0, 50.0, -50.0])
def test_a_clock_that_is_set_and_a_machine_that_slept_are_gaps(step_s: float) -> None:
    probe = Probe()
    probe.read(SETTLED + 7)
    probe.wall_s += step_s
    assert probe.live_s() is None
    probe.read(SETTLED)
    assert probe.live_s() == 7.0


def test_a_round_that_failed_is_a_gap() -> None:
    probe = Probe()
    probe.read(SETTLED + 7)
    probe.liveness.record_gap()
    assert probe.live_s() is None
    probe.read(1)
    assert probe.live_s() == 7.0


def test_the_clock_advances_between_outages_that_never_end() -> None:
    probe = Probe()
    for _ in range(5):
        probe.read(20)
        probe.liveness.record_gap()
    probe.read(1)
    assert probe.live_s() == 5 * (20 - SETTLED)


def test_nothing_is_judged_while_events_wait_and_the_clock_goes_on() -> None:
    probe = Probe()
    probe.read(SETTLED)
    probe.read(60, caught_up=False)
    assert probe.live_s() is None
    assert probe.liveness.rounds == SETTLED
    probe.read(1)
    assert probe.live_s() == 61.0


def test_the_clock_does_not_start_while_events_wait() -> None:
    probe = Probe()
    probe.read(60, caught_up=False)
    assert probe.live_s() is None
    probe.read(1)
    assert probe.live_s() == 0.0
