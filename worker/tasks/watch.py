"""How work tells its progress and hears that it should stop."""

from __future__ import annotations

from typing import Protocol


class Watch(Protocol):
    """Whoever looks after an attempt."""

    progress: float
    """How far the work is, 0 to 1: set by the work."""

    def should_stop(self) -> bool:
        """Return whether the work should end now."""
        ...


class PartWatched:
    """A watch over one part of the work: its progress is that of the whole, from one place to another."""

    def __init__(self, whole: Watch, first: float, last: float) -> None:
        self._whole, self._first, self._last = whole, first, last

    @property
    def progress(self) -> float:
        """How far the whole work is."""
        return self._whole.progress

    @progress.setter
    def progress(self, fraction: float) -> None:
        self._whole.progress = self._first + fraction * (self._last - self._first)

    def should_stop(self) -> bool:
        """Return whether the work should end now."""
        return self._whole.should_stop()


class Unwatched:
    """Nobody looks: for tests and local work."""

    progress = 0.0

    def should_stop(self) -> bool:
        """Return that the work should go on."""
        return False
