"""Run a child to its end: hear what it says, tell how far it is, end it when it must end.

The child ends by itself, or is told to: SIGTERM first (POV-Ray answers with exit code 2), SIGKILL after a grace. When
the worker itself is killed, the sandbox's PDEATHSIG ends the child; the kernel sends it when the *thread* that started
the child ends, so `run` starts and waits in one.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from lippmann.errors import SandboxMissing
from worker.engines.povray.progress import Lines, Progress, advance, is_progress
from worker.sandbox.child import Child
from worker.sandbox.log import AttemptLog

POLL_S = 0.2
"""Between two questions to `should_stop`, and between two reports of progress."""
LOG_PROGRESS_S = 5.0
"""Between two progress lines in the log."""

_KEPT_LINES = 3000


class Ending(StrEnum):
    """Why a child ended."""

    EXITED = "exited"
    STOPPED = "stopped"
    TIMED_OUT = "timed out"
    STALLED = "stalled"


@dataclass(frozen=True)
class Outcome:
    """What is left of a child."""

    ending: Ending
    exit_code: int
    """Negative: the signal that ended it."""
    lines: tuple[str, ...]
    """The last of what it said, without progress."""
    progress: Progress
    wall_s: float
    cpu_s: float
    """Of the child and all below it."""
    peak_memory_mb: float
    """Resident, of the largest process."""


def run(
    argv: Sequence[str],
    *,
    cwd: Path,
    env: Mapping[str, str],
    timeout_s: float,
    stall_s: float,
    first_block_px: int,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
    log: AttemptLog,
) -> Outcome:
    """Run a child to its end and return what is left of it.

    Whatever is raised in between, by a callback or by a signal's handler, the child is gone when this is left.

    Raises
    ------
    SandboxMissing
        If it cannot be started: what comes first on the command line is the sandbox.
    """
    started_s = time.monotonic()
    listener = _Listener(log, first_block_px)
    watch = _Watch(timeout_s=timeout_s, stall_s=stall_s, should_stop=should_stop)
    told, telling = listener.progress, _Every(POLL_S)
    with _started(argv, cwd, env) as child:
        while not child.is_over():
            listener.hear(child.read(POLL_S))
            if watch.look(listener.progress) is not Ending.EXITED:
                child.end()
            if listener.progress != told and telling.due():
                told = listener.progress
                on_progress(told)
    listener.close()
    if listener.progress != told:
        on_progress(listener.progress)
    return Outcome(
        ending=watch.ending,
        exit_code=child.exit_code,
        lines=tuple(listener.kept),
        progress=listener.progress,
        wall_s=time.monotonic() - started_s,
        cpu_s=child.cpu_s,
        peak_memory_mb=child.peak_memory_mb,
    )


def _started(argv: Sequence[str], cwd: Path, env: Mapping[str, str]) -> Child:
    try:
        return Child(argv, cwd=cwd, env=env)
    except OSError as error:
        raise SandboxMissing(f"The sandbox did not start: {error}") from error


class _Every:
    """Says yes at most once in so many seconds."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._last_s = -seconds

    def due(self) -> bool:
        now_s = time.monotonic()
        if now_s - self._last_s < self._seconds:
            return False
        self._last_s = now_s
        return True


class _Watch:
    """Decides whether a child must end; it does not change its mind."""

    def __init__(self, *, timeout_s: float, stall_s: float, should_stop: Callable[[], bool]) -> None:
        self.ending = Ending.EXITED
        self._should_stop = should_stop
        self._asking = _Every(POLL_S)
        self._moved_s = time.monotonic()
        self._deadline_s = self._moved_s + timeout_s
        self._stall_s = stall_s
        self._progress = Progress()

    def look(self, progress: Progress) -> Ending:
        now_s = time.monotonic()
        if progress != self._progress:
            self._progress, self._moved_s = progress, now_s
        if self.ending is Ending.EXITED:
            self.ending = self._ending(now_s)
        return self.ending

    def _ending(self, now_s: float) -> Ending:
        if self._asking.due() and self._should_stop():
            return Ending.STOPPED
        if now_s >= self._deadline_s:
            return Ending.TIMED_OUT
        if now_s - self._moved_s >= self._stall_s:
            return Ending.STALLED
        return Ending.EXITED


class _Listener:
    """Hears what a child says: progress, log, and the last lines."""

    def __init__(self, log: AttemptLog, first_block_px: int) -> None:
        self.progress = Progress()
        self.kept: deque[str] = deque(maxlen=_KEPT_LINES)
        self._lines = Lines()
        self._log = log
        self._logging = _Every(LOG_PROGRESS_S)
        self._unlogged: str | None = None
        self._first_block_px = first_block_px

    def hear(self, data: bytes) -> None:
        for line in self._lines.feed(data):
            self._take(line)

    def close(self) -> None:
        for line in self._lines.close():
            self._take(line)
        self._log_progress()

    def _take(self, line: str) -> None:
        self.progress = advance(self.progress, line, first_block_px=self._first_block_px)
        if is_progress(line):
            self._unlogged = line
            if self._logging.due():
                self._log_progress()
            return
        self._log_progress()
        self.kept.append(line)
        self._log.write(line)

    def _log_progress(self) -> None:
        if self._unlogged is not None:
            self._log.write(self._unlogged)
            self._unlogged = None
