"""Waiting for what other threads and processes do."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

ENOUGH_S = 300.0
"""A limit for what takes seconds when nothing else runs: tests also pass on a machine that does much else."""


def until(question: Any, *, within_s: float = ENOUGH_S, every_s: float = 0.01) -> Any:
    """Ask until the answer is yes; for things that other threads and processes do."""
    end_s = time.monotonic() + within_s
    while time.monotonic() < end_s:
        answer = question()
        if answer:
            return answer
        time.sleep(every_s)
    raise AssertionError(f"expected a yes within {within_s} s")


def halt(pid: int) -> None:
    """Stop a process with SIGSTOP and wait until all its threads stand still.

    Until then, a process on a busy machine may still handle another signal that has a lower number.
    """
    os.kill(pid, signal.SIGSTOP)
    until(lambda: all(_state(thread) in "TtZX" for thread in Path(f"/proc/{pid}/task").iterdir()))


def _state(thread: Path) -> str:
    try:
        return (thread / "stat").read_text().rpartition(")")[2].split()[0]
    except OSError:  # It has ended meanwhile.
        return "X"
