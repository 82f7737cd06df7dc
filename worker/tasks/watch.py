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


class Unwatched:
    """Nobody looks: for tests and local work."""

    progress = 0.0

    def should_stop(self) -> bool:
        """Return that the work should go on."""
        return False
