"""Since when every event has been heard without a gap: only in such a time does an attempt's silence mean anything."""

from __future__ import annotations

import threading
from collections.abc import Callable

CLOCKS_AGREE_S = 1.0
"""Between two rounds a clock that is set, or a machine that sleeps, parts the clocks by more."""


class Hearing:
    """What the follower's rounds say of how well the clerk hears; longer than `gap_s` between two is a gap."""

    def __init__(self, *, gap_s: float, clock: Callable[[], float], steady: Callable[[], float]) -> None:
        self._gap_s = gap_s
        self._clock = clock
        self._steady = steady
        self._lock = threading.Lock()
        self._since_s: float | None = None
        self._heard: tuple[float, float] | None = None
        self._is_behind = False

    def hear(self, *, all_of_it: bool) -> None:
        """Note a good round; not `all_of_it` while more events wait than one round takes."""
        with self._lock:
            now = self._now()
            if self._is_gap(now):
                self._since_s = None
            self._heard, self._is_behind = now, not all_of_it
            if self._since_s is None and all_of_it:
                self._since_s = now[0]

    def miss(self) -> None:
        """Note that nothing could be heard, or written down: "since" starts anew."""
        with self._lock:
            self._since_s = self._heard = None

    def since_s(self) -> float | None:
        """Return since when there was no gap; None if there is one now, or while events are behind."""
        with self._lock:
            return None if self._is_behind or self._is_gap(self._now()) else self._since_s

    def _now(self) -> tuple[float, float]:
        return self._clock(), self._steady()

    def _is_gap(self, now: tuple[float, float]) -> bool:
        if self._heard is None:
            return True
        passed_s, steady_s = (new - old for new, old in zip(now, self._heard, strict=True))
        return steady_s > self._gap_s or abs(passed_s - steady_s) > CLOCKS_AGREE_S
