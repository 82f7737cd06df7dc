"""Progress on stderr: a bar on a terminal, and plain lines in a pipe."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime
from types import TracebackType
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

LINE_EVERY_S = 5.0
"""The least time between two lines in a pipe, s, unless there is news."""


def duration_text(seconds: float | None) -> str:
    """Return a duration as text for people.

    >>> duration_text(8.2), duration_text(252), duration_text(7500), duration_text(None)
    ('9 s', '4 min 12 s', '2 h 05 min', '?')
    """
    if seconds is None:
        return "?"
    whole = int(-(-seconds // 1))
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60:02d} s"
    if whole < 100 * 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    return f"{whole // 86_400} days"


def time_text(when: datetime) -> str:
    """Return a time as text in ISO 8601, in the time zone of this machine.

    >>> from datetime import UTC
    >>> datetime.fromisoformat(time_text(datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC))).astimezone(UTC).isoformat()
    '2026-01-02T03:04:05+00:00'
    """
    return when.astimezone().isoformat(timespec="seconds")


def utc_text(seconds: float) -> str:
    """Return a time in seconds since 1970 as text in ISO 8601, in UTC, for programs.

    >>> utc_text(0.5)
    '1970-01-01T00:00:00Z'
    """
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def size_text(count: float) -> str:
    """Return a number of bytes as text for people.

    >>> size_text(999), size_text(1_250_000)
    ('999 B', '1.2 MB')
    """
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.0f} {unit}" if unit == "B" else f"{count:.1f} {unit}"
        count /= 1000
    return f"{count:.1f} TB"


class ProgressLine:
    """Prints progress to stderr; a context manager."""

    def __init__(self, label: str, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._label = label
        self._clock = clock
        self._bar: Progress | None = None
        self._task: TaskID | None = None
        self._printed = ""
        self._printed_at_s = float("-inf")

    def __enter__(self) -> Self:
        if sys.stderr.isatty():
            self._bar = _rich_bar()
            self._task = self._bar.add_task(self._label, total=1.0, text="")
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def show(self, part: float, text: str, *, news: bool = False) -> None:
        """Print that `part` (0 to 1) of the work is done; `news` is printed at once, also in a pipe."""
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=part, text=text)
            return
        line = f"{self._label}: {part:4.0%} {text}"
        now = self._clock()
        if line != self._printed and (news or now - self._printed_at_s >= LINE_EVERY_S):
            print(line, file=sys.stderr, flush=True)
            self._printed, self._printed_at_s = line, now


def _rich_bar() -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TextColumn("{task.fields[text]}", markup=False),
    )
    return Progress(*columns, console=Console(stderr=True), refresh_per_second=4)
