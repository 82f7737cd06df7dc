"""The machine on which a figure was made, because times mean nothing without it."""

from __future__ import annotations

import os
import platform
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from worker.engines.povray.version import povray_version


@dataclass(frozen=True)
class Machine:
    """Processor and renderer."""

    cpu: str
    cores: int
    povray: str
    date: str
    """The day of the measurement, UTC."""

    def __str__(self) -> str:
        return f"{self.cpu}, {self.cores} cores, POV-Ray {self.povray}, {self.date}"

    def data(self) -> dict[str, Any]:
        """Return the machine as data for JSON."""
        return asdict(self)


def this_machine(povray: str) -> Machine:
    """Return the description of this machine.

    Raises
    ------
    lippmann.errors.PovrayMissing
        If POV-Ray does not answer.
    """
    return Machine(
        cpu=cpu_model(_cpuinfo()) or platform.processor() or platform.machine(),
        cores=len(os.sched_getaffinity(0)),
        povray=povray_version(povray),
        date=datetime.now(UTC).date().isoformat(),
    )


def cpu_model(cpuinfo: str) -> str | None:
    r"""Return the processor that the text of /proc/cpuinfo names.

    >>> cpu_model("processor : 0\nmodel name\t: Pentium 4 CPU 3.00GHz\n")
    'Pentium 4 CPU 3.00GHz'
    """
    for line in cpuinfo.splitlines():
        name, _, value = line.partition(":")
        if name.strip() == "model name" and value.strip():
            return value.strip()
    return None


def _cpuinfo() -> str:
    try:
        return Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
