"""Progress monitors: work reports its progress to one and asks it whether to stop."""

from __future__ import annotations

from typing import Protocol


class ProgressMonitor(Protocol):
    """Receives the progress of an attempt and knows whether it should stop."""

    progress: float
    """The share of the work that is done, 0 to 1; the work sets it."""

    def should_stop(self) -> bool:
        """Return whether the work should end now."""
        ...

    def announce_end(self) -> None:
        """Announce that the work will soon need its core no longer, so that the next attempt may start."""
        ...


class PartMonitor:
    """The monitor of one part of the work: its progress from 0 to 1 is that of the whole from `first` to `last`."""

    def __init__(self, whole: ProgressMonitor, first: float, last: float) -> None:
        self._whole, self._first, self._last = whole, first, last

    @property
    def progress(self) -> float:
        """The progress of the whole work."""
        return self._whole.progress

    @progress.setter
    def progress(self, fraction: float) -> None:
        self._whole.progress = self._first + fraction * (self._last - self._first)

    def should_stop(self) -> bool:
        """Return whether the work should end now."""
        return self._whole.should_stop()

    def announce_end(self) -> None:
        """Announce the end of the whole work if this is its last part."""
        if self._last == 1.0:
            self._whole.announce_end()


class NullMonitor:
    """Ignores the progress and never stops the work: for tests and local work."""

    progress = 0.0

    def should_stop(self) -> bool:
        """Return False."""
        return False

    def announce_end(self) -> None:
        """Do nothing."""
