"""Why and when a child must end: the limits of time, the totals, and a stop."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.output import Interval, ProgressReader

POLL_S = 0.2
"""The interval of calls to `should_stop`."""


class Ending(StrEnum):
    """Why a child ended, or why the wait for its answer did."""

    EXITED = "exited"
    STOPPED = "stopped"
    TIMED_OUT = "timed out"
    STALLED = "stalled"
    PHASE_TIMED_OUT = "phase timed out"
    TOO_MUCH = "too much"
    """It exceeded a total; see `totals`."""
    TOO_MUCH_MEMORY = "too much memory"
    TOO_MUCH_CPU = "too much CPU"
    ANSWERED = "answered"
    """It has answered a request and lives on; see `conversation`."""


@dataclass(frozen=True)
class Excess:
    """A total that was exceeded."""

    message: str
    ending: Ending = Ending.TOO_MUCH


class EndingRule:
    """Decides whether and why a child must end; the first decision is final."""

    def __init__(self, reader: ProgressReader[object], times: TimeLimits, should_stop: Callable[[], bool]) -> None:
        self.ending = Ending.EXITED
        self.excess = ""
        self.find_excess: Callable[[], Excess | None] = lambda: None
        self._reader = reader
        self._times = times
        self._should_stop = should_stop
        self._stop_timer = Interval(POLL_S)
        self._totals_timer = Interval(POLL_S)
        self._phase, self._growth = reader.phase, reader.growth
        self._moved_s = time.monotonic()
        self._deadline_s = self._moved_s + times.total.seconds

    def update(self) -> Ending:
        """Return why the child must end; `EXITED` while it need not."""
        now_s = time.monotonic()
        phase, growth = self._reader.phase, self._reader.growth
        # Growth in a phase with a limit does not prolong it.
        if phase != self._phase or (growth != self._growth and phase not in self._times.phases):
            self._moved_s = now_s
        self._phase, self._growth = phase, growth
        if self.ending is Ending.EXITED:
            self.ending = self._ending(now_s)
        return self.ending

    def run_out_of_memory(self, limits: Limits) -> None:
        """Note that the kernel ended the child because its group was at the limit of memory."""
        if self.ending is Ending.EXITED:
            self.ending = Ending.TOO_MUCH_MEMORY
            self.excess = f"its processes together have the memory of its cgroup; the limit is {limits.memory_mb} MB"

    def _ending(self, now_s: float) -> Ending:
        if self._stop_timer.is_due() and self._should_stop():
            return Ending.STOPPED
        if self._totals_timer.is_due() and (excess := self.find_excess()):
            self.excess = excess.message
            return excess.ending
        if now_s >= self._deadline_s:
            return Ending.TIMED_OUT
        limit = self._times.phases.get(self._phase)
        if now_s - self._moved_s >= (limit or self._times.stall).seconds:
            return Ending.PHASE_TIMED_OUT if limit else Ending.STALLED
        return Ending.EXITED
