"""The forecast of the end of tracing, from reports as POV-Ray makes them."""

from __future__ import annotations

import pytest

from worker.engines.povray.answers.forecast import LEAD_S, LEAST_S, EndForecast
from worker.engines.povray.answers.progress import Phase, Progress


class Clock:
    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def first_forecast_s(trace_s: float, *, every_s: float = 0.05) -> float | None:
    """Return how long before the end of the tracing it is first said to end soon; None if never."""
    clock = Clock()
    forecast = EndForecast(clock=clock)
    assert not forecast.ends_soon(Progress(phase=Phase.PARSING))
    spent_s = 0.0
    while spent_s < trace_s:
        clock.now_s, spent_s = clock.now_s + every_s, spent_s + every_s
        fraction = min(1.0, spent_s / trace_s)
        if forecast.ends_soon(Progress(phase=Phase.RENDERING, fraction=fraction)):
            return trace_s - spent_s
    return None


@pytest.mark.parametrize("trace_s", [1.0, 6.6, 600.0])
def test_the_end_is_forecast_about_as_long_before_it_as_the_next_engine_needs_to_start(trace_s: float) -> None:
    before_s = first_forecast_s(trace_s)
    assert before_s is not None
    assert LEAD_S - 0.1 <= before_s <= LEAD_S + 0.01


def test_a_short_trace_is_forecast_as_soon_as_its_rate_is_known() -> None:
    before_s = first_forecast_s(0.5)
    assert before_s is not None
    assert 0.5 - before_s >= LEAST_S


def test_the_time_from_the_preparation_to_the_first_report_counts() -> None:
    clock = Clock()
    forecast = EndForecast(clock=clock)
    assert not forecast.ends_soon(Progress(phase=Phase.PREPARING))
    clock.now_s += 0.2
    assert forecast.ends_soon(Progress(phase=Phase.RENDERING, fraction=0.4))


def test_a_trace_that_is_over_with_its_first_report_has_ended() -> None:
    assert EndForecast().ends_soon(Progress(phase=Phase.RENDERING, fraction=1.0))


@pytest.mark.parametrize("phase", [phase for phase in Phase if phase is not Phase.RENDERING])
def test_nothing_is_forecast_before_the_last_phase(phase: Phase) -> None:
    clock = Clock()
    forecast = EndForecast(clock=clock)
    for fraction in (0.0, 0.1, 0.3):
        clock.now_s += 1.0
        assert not forecast.ends_soon(Progress(phase=phase, fraction=fraction))


def test_the_pretrace_counts_neither_as_time_nor_as_progress_of_the_trace() -> None:
    clock = Clock()
    forecast = EndForecast(clock=clock)
    assert not forecast.ends_soon(Progress(phase=Phase.PRETRACE, fraction=0.29))
    clock.now_s += 0.1
    assert not forecast.ends_soon(Progress(phase=Phase.RENDERING, fraction=0.3))
    clock.now_s += 0.2
    assert not forecast.ends_soon(Progress(phase=Phase.RENDERING, fraction=0.4))
