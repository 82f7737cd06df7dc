"""Waiting for what other threads and processes do."""

from __future__ import annotations

import time
from typing import Any

ENOUGH_S = 300.0
"""A limit for what takes seconds when nothing else runs: tests also pass on a machine that does much else."""


def until(question: Any, *, within_s: float = ENOUGH_S) -> Any:
    """Ask until the answer is yes; for things that other threads and processes do."""
    end_s = time.monotonic() + within_s
    while time.monotonic() < end_s:
        answer = question()
        if answer:
            return answer
        time.sleep(0.01)
    raise AssertionError(f"expected a yes within {within_s} s")
