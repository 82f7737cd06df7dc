"""Liveness: since when the coordinator has read every event. Only in such a period is a silent attempt a lost one."""

from __future__ import annotations

import threading
from collections.abc import Callable

MAX_CLOCK_DRIFT_S = 1.0
"""The wall clock and the steady clock differ by more than this between two rounds if the wall clock was set, or if the
machine slept."""


class Liveness:
    """The period since the last gap in reading the stream of events.

    Parameters
    ----------
    gap_s
        A longer time between two rounds is a gap.
    clock
        The wall clock, in seconds since 1970.
    steady
        A clock that is never set, in seconds.
    """

    def __init__(self, *, gap_s: float, clock: Callable[[], float], steady: Callable[[], float]) -> None:
        self._gap_s = gap_s
        self._clock = clock
        self._steady = steady
        self._lock = threading.Lock()
        self._since_s: float | None = None
        self._last_round: tuple[float, float] | None = None
        self._is_behind = False

    def record_round(self, *, caught_up: bool) -> None:
        """Record a round that read events; `caught_up` is False if more events wait than one round reads."""
        with self._lock:
            now = self._now()
            if self._is_gap(now):
                self._since_s = None
            self._last_round, self._is_behind = now, not caught_up
            if self._since_s is None and caught_up:
                self._since_s = now[0]

    def record_gap(self) -> None:
        """Record that events could not be read or written; the period starts anew."""
        with self._lock:
            self._since_s = self._last_round = None

    def since_s(self) -> float | None:
        """Return the wall time of the last gap; None during a gap, or while events wait to be read."""
        with self._lock:
            return None if self._is_behind or self._is_gap(self._now()) else self._since_s

    def _now(self) -> tuple[float, float]:
        return self._clock(), self._steady()

    def _is_gap(self, now: tuple[float, float]) -> bool:
        if self._last_round is None:
            return True
        wall_s, steady_s = (new - old for new, old in zip(now, self._last_round, strict=True))
        return steady_s > self._gap_s or abs(wall_s - steady_s) > MAX_CLOCK_DRIFT_S
