"""Run a child process to its end: read its output, report its progress, and end it when a limit is reached.

The child ends by itself, or it is sent SIGTERM and, after a grace period, SIGKILL. When the worker itself is killed,
the sandbox's PDEATHSIG ends the child; the kernel sends it when the *thread* that started the child ends, so `run`
starts the child and waits for it in one thread.

What the output means is the engine's affair: `run` splits it into lines and hands each line to a `ProgressReader`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Generic, TypeVar

from lippmann.errors import SandboxMissing
from worker.sandbox.child import Child, lost_cpu
from worker.sandbox.ending import POLL_S, Ending, EndingRule, Excess
from worker.sandbox.groups import Groups, TaskGroup
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.output import Interval, OutputReader, ProgressReader
from worker.sandbox.totals import find_excess

REPORT_S = 0.05
"""The least time between two reports of progress."""

P = TypeVar("P")


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
    output = OutputReader(log, reader)
    rule = EndingRule(reader, times, should_stop)
    reported, report_timer = reader.progress, Interval(REPORT_S)
    cpu_s = 0.0
    with group_of(groups, limits) as group:
        with started(argv if group is None else group.entering(argv), cwd, env) as child:
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


def group_of(groups: Groups | None, limits: Limits | None) -> AbstractContextManager[TaskGroup | None]:
    """Return the group of a child, if there is one."""
    return nullcontext() if groups is None or limits is None else groups.task(limits)


def _excess(folder: Path, child: Child, limits: Limits) -> Excess | None:
    return find_excess(folder, child.pids(), limits)


def started(argv: Sequence[str], cwd: Path, env: Mapping[str, str], *, listens: bool = False) -> Child:
    """Start a child; see `Child`.

    Raises
    ------
    SandboxMissing
        If it cannot be started.
    """
    try:
        return Child(argv, cwd=cwd, env=env, listens=listens)
    except OSError as error:
        raise SandboxMissing(f"The sandbox did not start: {error}") from error
