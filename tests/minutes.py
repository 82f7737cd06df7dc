"""The clock of the rates of requests, stopped, so that no test runs over the end of a minute."""

from __future__ import annotations

import pytest

BEGIN_S = 1_900_022_401.0
"""A second after the beginning of a minute, in seconds since 1970."""


class Clock:
    """Stands in for the module `time` where rates are counted."""

    def __init__(self) -> None:
        self.now_s = BEGIN_S

    def time(self) -> float:
        return self.now_s


def stop_minutes(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Stop the clock of the rates soon after the beginning of a minute, and return it."""
    clock = Clock()
    for module in ("service.rate_limits", "limits.aio.strategies", "limits.aio.storage.memory"):
        monkeypatch.setattr(f"{module}.time", clock)
    return clock
