"""Limits of one child process: resource limits, enforced by the kernel, and time limits, enforced by `process.run`.

`prlimit` of util-linux sets the limits and becomes the program: nothing of ours runs between fork and exec, where a
preexec_fn could deadlock on another thread's lock.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

CPU_GRACE_S = 5
"""The time from SIGXCPU, which is sent at the CPU limit, to SIGKILL."""

PROCESSES = 64
"""POV-Ray starts no process and, with one render thread, about ten threads."""

_MIB = 1024 * 1024


@dataclass(frozen=True)
class Limits:
    """The resource limits of one attempt."""

    cpu_s: float
    memory_mb: int
    """The limit of the address space."""
    file_mb: int = 8192
    """The limit of the size of one file. POV-Ray stores its state beside the picture: 20 bytes per pixel."""


@dataclass(frozen=True)
class TimeLimit:
    """A limit of elapsed time, and the place where a user may change it."""

    seconds: float
    source: str
    """The field of the job or the setting of the worker that gives the limit."""

    def or_lower(self, seconds: float | None, source: str) -> TimeLimit:
        """Return the lower one of this limit and another, which may be absent.

        >>> TimeLimit(900.0, "the job").or_lower(60.0, "the worker").source
        'the worker'
        """
        return self if seconds is None or seconds >= self.seconds else TimeLimit(seconds, source)

    def __str__(self) -> str:
        return f"{self.seconds:g} s, the limit that {self.source} gives"


@dataclass(frozen=True)
class TimeLimits:
    """The time limits of one child process."""

    total: TimeLimit
    """The limit of the whole run."""
    stall: TimeLimit
    """The limit of the time without growth, in a phase that has no limit of its own."""
    phases: Mapping[str, TimeLimit] = field(default_factory=dict)
    """The limits of phases whose length cannot be foreseen, so that their progress proves nothing."""


def limited(argv: Sequence[str], limits: Limits, *, counted_alone: bool) -> list[str]:
    """Return a command line that runs `argv` within limits.

    The number of processes is limited only where they are counted alone, in their own user namespace. Elsewhere the
    kernel counts all processes of the user, and POV-Ray would fail because of others. Root is never limited.
    """
    cpu_s = math.ceil(limits.cpu_s)
    return [
        "prlimit",
        "--core=0",
        f"--cpu={cpu_s}:{cpu_s + CPU_GRACE_S}",
        f"--as={limits.memory_mb * _MIB}",
        f"--fsize={limits.file_mb * _MIB}",
        *([f"--nproc={PROCESSES}"] if counted_alone else []),
        "--",
        *argv,
    ]
