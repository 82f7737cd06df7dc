"""Silence means a lost attempt only while every event is read."""

from __future__ import annotations

import pytest

from service.coordinator.liveness import Liveness

GAP_S = 15.0


class Probe:
    """A liveness, and two clocks that the test moves."""

    def __init__(self) -> None:
        self.wall_s, self.steady_s = 1000.0, 50.0
        self.liveness = Liveness(gap_s=GAP_S, clock=lambda: self.wall_s, steady=lambda: self.steady_s)

    def wait(self, seconds: float) -> None:
        self.wall_s += seconds
        self.steady_s += seconds

    def read(self, seconds: int, *, caught_up: bool = True) -> None:
        for _ in range(seconds):
            self.wait(1)
            self.liveness.record_round(caught_up=caught_up)

    def since_s(self) -> float | None:
        return self.liveness.since_s()


def test_liveness_begins_with_the_first_round() -> None:
    probe = Probe()
    assert probe.since_s() is None
    probe.read(100)
    assert probe.since_s() == 1001.0


def test_liveness_starts_anew_after_a_gap() -> None:
    probe = Probe()
    probe.read(10)
    probe.wait(GAP_S)
    assert probe.since_s() == 1001.0
    probe.wait(0.1)
    assert probe.since_s() is None
    probe.liveness.record_round(caught_up=True)
    assert probe.since_s() == probe.wall_s


@pytest.mark.parametrize("step_s", [3600.0, 50.0, -50.0])
def test_a_clock_that_is_set_and_a_machine_that_slept_are_gaps(step_s: float) -> None:
    probe = Probe()
    probe.read(10)
    probe.wall_s += step_s
    assert probe.since_s() is None
    probe.liveness.record_round(caught_up=True)
    assert probe.since_s() == probe.wall_s


def test_a_round_that_failed_is_a_gap() -> None:
    probe = Probe()
    probe.read(10)
    probe.liveness.record_gap()
    assert probe.since_s() is None
    probe.read(1)
    assert probe.since_s() == probe.wall_s


def test_there_is_no_liveness_while_events_wait_and_its_beginning_stays() -> None:
    probe = Probe()
    probe.read(10)
    probe.read(60, caught_up=False)
    assert probe.since_s() is None
    probe.read(1)
    assert probe.since_s() == 1001.0


def test_since_does_not_begin_while_behind() -> None:
    probe = Probe()
    probe.read(10, caught_up=False)
    assert probe.since_s() is None
    probe.read(1)
    assert probe.since_s() == probe.wall_s
