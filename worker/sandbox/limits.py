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

OPEN_FILES = 256

_MIB = 1024 * 1024


@dataclass(frozen=True)
class Limits:
    """The resource limits of one attempt."""

    cpu_s: float
    memory_mb: int
    """The limit of the address space of each process, and of the memory of all processes of the task together."""
    file_mb: int = 8192
    """The limit of the size of one file. POV-Ray stores its state beside the picture: 20 bytes per pixel."""
    disk_mb: int = 16_384
    """The limit of all files of the task together, those included that were removed and are still open."""
    files: int = 2000
    """The limit of the number of files and folders of the task."""
    processes: int = PROCESSES
    """The limit of the number of processes and threads."""
    address_space: bool = True
    """True if the kernel limits the address space of each process. The driver of a GPU reserves more than it uses."""


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


def limited(argv: Sequence[str], limits: Limits, *, processes: int | None = PROCESSES) -> list[str]:
    """Return a command line that runs `argv` within limits.

    The kernel limits the number of `processes` only where they are counted alone, in their own user namespace or as
    their own user. Elsewhere it counts all processes of the user, and POV-Ray would fail because of others.
    """
    cpu_s = math.ceil(limits.cpu_s)
    return [
        "prlimit",
        "--core=0",
        f"--cpu={cpu_s}:{cpu_s + CPU_GRACE_S}",
        *([f"--as={limits.memory_mb * _MIB}"] if limits.address_space else []),
        f"--fsize={limits.file_mb * _MIB}",
        f"--nofile={OPEN_FILES}",
        "--msgqueue=0",
        "--rtprio=0",
        *([] if processes is None else [f"--nproc={processes}"]),
        "--",
        *argv,
    ]
