"""The output of a child in lines: handed to the reader of its progress, to the log, and kept for a diagnosis."""

from __future__ import annotations

import time
from collections import deque
from typing import Protocol, TypeVar

from worker.sandbox.log import AttemptLog

LOG_PROGRESS_S = 5.0
"""The interval of progress lines in the log."""
MAX_LINE_BYTES = 16_384
"""A program can print a line without end; in the log and among the last lines, it is cut at this length."""

_KEPT_LINES = 3000

ReadProgress = TypeVar("ReadProgress", covariant=True)


class ProgressReader(Protocol[ReadProgress]):
    """Reads the progress of a program from its output; each engine has its own."""

    @property
    def progress(self) -> ReadProgress:
        """The progress so far. It is reported when it changes."""
        ...

    @property
    def phase(self) -> str:
        """The phase of the work. A phase that has been left never returns."""
        ...

    @property
    def growth(self) -> float:
        """The share of the work that is done: it only grows, up to 1. A program has stalled when it stays equal."""
        ...

    def read(self, line: str) -> bool:
        """Update the progress from the next line of output; return whether the line reports nothing else."""
        ...


class Lines:
    r"""Splits bytes that arrive in any pieces into lines, at \r and \n."""

    def __init__(self, max_bytes: int = MAX_LINE_BYTES) -> None:
        self._rest = b""
        self._max_bytes = max_bytes

    def feed(self, data: bytes) -> list[str]:
        """Return the lines that these bytes complete."""
        *whole, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(self._rest) > self._max_bytes:
            whole.append(self._rest)
            self._rest = b""
        return [line[: self._max_bytes].decode(errors="replace") for line in whole]

    def close(self) -> list[str]:
        """Return the unfinished last line, if there is one."""
        return self.feed(b"\n") if self._rest else []


class Interval:
    """Is due at most once in a number of seconds."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._last_s = -seconds

    def is_due(self) -> bool:
        """Return whether it is due; then it is not for as long again."""
        now_s = time.monotonic()
        if now_s - self._last_s < self._seconds:
            return False
        self._last_s = now_s
        return True


class OutputReader:
    """Hands a child's output to the progress reader and the log, and keeps the last lines."""

    def __init__(
        self, log: AttemptLog, reader: ProgressReader[object], *, max_line_bytes: int = MAX_LINE_BYTES
    ) -> None:
        self.kept: deque[str] = deque(maxlen=_KEPT_LINES)
        self.lines = 0
        self._lines = Lines(max_line_bytes)
        self._log = log
        self._log_timer = Interval(LOG_PROGRESS_S)
        self._unlogged: str | None = None
        self._reader = reader

    def feed(self, data: bytes) -> None:
        """Take the next bytes."""
        for line in self._lines.feed(data):
            self._take(line)

    def close(self) -> None:
        """Take the unfinished last line, if there is one."""
        for line in self._lines.close():
            self._take(line)
        self._log_progress()

    def _take(self, line: str) -> None:
        self.lines += 1
        is_progress = self._reader.read(line)
        line = line[:MAX_LINE_BYTES]
        if is_progress:
            self._unlogged = line
            if self._log_timer.is_due():
                self._log_progress()
            return
        self._log_progress()
        self.kept.append(line)
        self._log.write(line)

    def _log_progress(self) -> None:
        if self._unlogged is not None:
            self._log.write(self._unlogged)
            self._unlogged = None
