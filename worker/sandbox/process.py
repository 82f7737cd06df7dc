"""Run a child process to its end: read its output, report its progress, and end it when a limit is reached.

The child ends by itself, or it is sent SIGTERM and, after a grace period, SIGKILL. When the worker itself is killed,
the sandbox's PDEATHSIG ends the child; the kernel sends it when the *thread* that started the child ends, so `run`
starts the child and waits for it in one thread.

What the output means is the engine's affair: `run` splits it into lines and hands each line to a `ProgressReader`.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from lippmann.errors import SandboxMissing
from worker.sandbox.child import Child, lost_cpu
from worker.sandbox.groups import Groups, TaskGroup
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.totals import Excess, find_excess

POLL_S = 0.2
"""The interval of calls to `should_stop`."""
REPORT_S = 0.05
"""The least time between two reports of progress."""
LOG_PROGRESS_S = 5.0
"""The interval of progress lines in the log."""
MAX_LINE_BYTES = 16_384
"""A program can print a line without end; it is cut at this length."""

_KEPT_LINES = 3000

P = TypeVar("P")
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


class Ending(StrEnum):
    """Why a child ended."""

    EXITED = "exited"
    STOPPED = "stopped"
    TIMED_OUT = "timed out"
    STALLED = "stalled"
    PHASE_TIMED_OUT = "phase timed out"
    TOO_MUCH = "too much"
    """It exceeded a total; see `totals`."""
    TOO_MUCH_MEMORY = "too much memory"


@dataclass(frozen=True)
class Outcome(Generic[P]):
    """The end of a child process, and the resources that it used."""

    ending: Ending
    exit_code: int
    """A negative number is the signal that ended it."""
    lines: tuple[str, ...]
    """The last lines of its output, without progress."""
    progress: P
    wall_s: float
    cpu_s: float
    """CPU time of the child and of all processes below it; where it has no cgroup, of those that were waited for."""
    peak_memory_mb: float
    """Resident memory of the largest process."""
    excess: str = ""
    """The total that it exceeded."""


def run(
    argv: Sequence[str],
    *,
    cwd: Path,
    env: Mapping[str, str],
    times: TimeLimits,
    reader: ProgressReader[P],
    on_progress: Callable[[P], None],
    should_stop: Callable[[], bool],
    log: AttemptLog,
    limits: Limits | None = None,
    groups: Groups | None = None,
) -> Outcome[P]:
    """Run a child to its end and return its outcome.

    The child has ended when this function is left, whatever a callback or a signal handler raises meanwhile.

    Parameters
    ----------
    argv, cwd, env
        The command line, working directory and whole environment of the child.
    times
        The child is ended after the total time, after too long a time without growth, and after too long a time in a
        phase that has a limit.
    reader
        Reads the progress from the child's output.
    on_progress
        Is called when the progress has changed, at most every `REPORT_S` seconds and once at the end.
    should_stop
        Is called every `POLL_S` seconds; True ends the child.
    log
        Receives the output.
    limits
        The totals of the folder `cwd`, of memory and of processes; the child is ended when it exceeds one.
    groups
        Where the child has a group of its own, in which the kernel limits memory and processes together.

    Raises
    ------
    SandboxMissing
        If the child cannot be started, as the first word of the command line is the sandbox's program, or if its group
        cannot be made.
    """
    started_s = time.monotonic()
    output = _OutputReader(log, reader)
    rule = _EndingRule(reader, times, should_stop)
    reported, report_timer = reader.progress, _Interval(REPORT_S)
    cpu_s = 0.0
    with _group(groups, limits) as group:
        with _started(argv if group is None else group.entering(argv), cwd, env) as child:
            if limits is not None:
                rule.find_excess = partial(_excess, cwd, child, limits)
            while not child.is_over():
                output.feed(child.read(POLL_S if reader.progress == reported else REPORT_S))
                if rule.update() is not Ending.EXITED:
                    child.end()
                if reader.progress != reported and report_timer.is_due():
                    reported = reader.progress
                    on_progress(reported)
        if limits is not None and group is not None:
            cpu_s = group.cpu_s()
            lost_cpu.add(counted_s=child.cpu_s, of_group_s=cpu_s)
            if group.ran_out_of_memory():
                rule.run_out_of_memory(limits)
    output.close()
    if reader.progress != reported:
        on_progress(reader.progress)
    return Outcome(
        ending=rule.ending,
        exit_code=child.exit_code,
        lines=tuple(output.kept),
        progress=reader.progress,
        wall_s=time.monotonic() - started_s,
        cpu_s=max(child.cpu_s, cpu_s),
        peak_memory_mb=child.peak_memory_mb,
        excess=rule.excess,
    )


class Lines:
    r"""Splits bytes that arrive in any pieces into lines, at \r and \n."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[str]:
        """Return the lines that these bytes complete."""
        *whole, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(self._rest) > MAX_LINE_BYTES:
            whole.append(self._rest)
            self._rest = b""
        return [line[:MAX_LINE_BYTES].decode(errors="replace") for line in whole]

    def close(self) -> list[str]:
        """Return the unfinished last line, if there is one."""
        return self.feed(b"\n") if self._rest else []


def _group(groups: Groups | None, limits: Limits | None) -> AbstractContextManager[TaskGroup | None]:
    return nullcontext() if groups is None or limits is None else groups.task(limits)


def _excess(folder: Path, child: Child, limits: Limits) -> Excess | None:
    return find_excess(folder, child.pids(), limits)


def _started(argv: Sequence[str], cwd: Path, env: Mapping[str, str]) -> Child:
    try:
        return Child(argv, cwd=cwd, env=env)
    except OSError as error:
        raise SandboxMissing(f"The sandbox did not start: {error}") from error


class _Interval:
    """Is due at most once in a number of seconds."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._last_s = -seconds

    def is_due(self) -> bool:
        now_s = time.monotonic()
        if now_s - self._last_s < self._seconds:
            return False
        self._last_s = now_s
        return True


class _EndingRule:
    """Decides whether and why a child must end; the first decision is final."""

    def __init__(self, reader: ProgressReader[object], times: TimeLimits, should_stop: Callable[[], bool]) -> None:
        self.ending = Ending.EXITED
        self.excess = ""
        self.find_excess: Callable[[], Excess | None] = lambda: None
        self._reader = reader
        self._times = times
        self._should_stop = should_stop
        self._stop_timer = _Interval(POLL_S)
        self._totals_timer = _Interval(POLL_S)
        self._phase, self._growth = reader.phase, reader.growth
        self._moved_s = time.monotonic()
        self._deadline_s = self._moved_s + times.total.seconds

    def update(self) -> Ending:
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
            return Ending.TOO_MUCH_MEMORY if excess.of_memory else Ending.TOO_MUCH
        if now_s >= self._deadline_s:
            return Ending.TIMED_OUT
        limit = self._times.phases.get(self._phase)
        if now_s - self._moved_s >= (limit or self._times.stall).seconds:
            return Ending.PHASE_TIMED_OUT if limit else Ending.STALLED
        return Ending.EXITED


class _OutputReader:
    """Hands a child's output to the progress reader and the log, and keeps the last lines."""

    def __init__(self, log: AttemptLog, reader: ProgressReader[object]) -> None:
        self.kept: deque[str] = deque(maxlen=_KEPT_LINES)
        self._lines = Lines()
        self._log = log
        self._log_timer = _Interval(LOG_PROGRESS_S)
        self._unlogged: str | None = None
        self._reader = reader

    def feed(self, data: bytes) -> None:
        for line in self._lines.feed(data):
            self._take(line)

    def close(self) -> None:
        for line in self._lines.close():
            self._take(line)
        self._log_progress()

    def _take(self, line: str) -> None:
        if self._reader.read(line):
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
