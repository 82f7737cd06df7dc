"""Liveness: for how long the coordinator has read every event. Only in such a time does silence mean anything."""

from __future__ import annotations

import threading
from collections.abc import Callable

MAX_CLOCK_DRIFT_S = 1.0
"""The wall clock and the steady clock differ by more than this between two rounds if the wall clock was set, or if the
machine slept."""
LONGEST_ROUND_S = 15.0
"""A longer time between two rounds is a gap."""
RECOVERY_S = 10.0
"""The time that workers have after a gap to connect again, before silence counts."""


class Liveness:
    """A clock that runs while every event is read, and stands still in a gap and for a while after it.

    Parameters
    ----------
    silence_s
        The time without a heartbeat after which an attempt is lost; a short one shortens the times above.
    clock
        The wall clock, in seconds since 1970.
    steady
        A clock that is never set, in seconds.
    """

    def __init__(self, *, silence_s: float, clock: Callable[[], float], steady: Callable[[], float]) -> None:
        self._gap_s = min(LONGEST_ROUND_S, silence_s / 3)
        self._recovery_s = min(RECOVERY_S, silence_s / 4.5)
        self._clock = clock
        self._steady = steady
        self._lock = threading.Lock()
        self._live_s = 0.0
        self._rounds = 0
        self._since_s: float | None = None
        self._last_round: tuple[float, float] | None = None
        self._is_behind = False

    def record_round(self, *, caught_up: bool) -> None:
        """Record a round that read events; `caught_up` is False if more events wait than one round reads."""
        with self._lock:
            now = self._now()
            if self._is_gap(now):
                self._since_s = None
            elif self._last_round is not None and self._since_s is not None:
                counted_from_s = max(self._last_round[1], self._since_s + self._recovery_s)
                self._live_s += max(0.0, now[1] - counted_from_s)
            self._last_round, self._is_behind = now, not caught_up
            self._rounds += caught_up
            if self._since_s is None and caught_up:
                self._since_s = now[1]

    def record_gap(self) -> None:
        """Record that events could not be read or written."""
        with self._lock:
            self._since_s = self._last_round = None

    def live_s(self) -> float | None:
        """Return the time for which every event was read; None during a gap, or while events wait to be read."""
        with self._lock:
            is_doubtful = self._since_s is None or self._is_behind or self._is_gap(self._now())
            return None if is_doubtful else self._live_s

    @property
    def rounds(self) -> int:
        """The number of rounds that read every event there was."""
        return self._rounds

    def _now(self) -> tuple[float, float]:
        return self._clock(), self._steady()

    def _is_gap(self, now: tuple[float, float]) -> bool:
        if self._last_round is None:
            return True
        wall_s, steady_s = (new - old for new, old in zip(now, self._last_round, strict=True))
        return steady_s > self._gap_s or abs(wall_s - steady_s) > MAX_CLOCK_DRIFT_S
