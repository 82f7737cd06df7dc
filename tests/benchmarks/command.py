"""How long the command takes, and what an idle farm holds."""

from __future__ import annotations

import os
import subprocess
import time
from pathlib import Path

from tests.farm import LIPPMANN, farm_up

ROUNDS = 5
SETTLE_S = 5.0


def help_s(folder: Path) -> str:
    """Return the seconds of `lippmann --help`: the best of some, the disk warm."""

    def once() -> float:
        started_s = time.monotonic()
        subprocess.run([LIPPMANN, "--help"], check=True, capture_output=True, cwd=folder)
        return time.monotonic() - started_s

    return f"{min(once() for _ in range(ROUNDS)):.2f} s"


def start_s(folder: Path) -> str:
    """Return the seconds from starting `up` on an empty folder to its first answer."""
    started_s = time.monotonic()
    with farm_up(folder / "data") as farm:
        farm.client.health()
        return f"{time.monotonic() - started_s:.1f} s"


def idle_mb(folder: Path) -> str:
    """Return the memory of all processes of an idle farm, shared pages counted once (PSS)."""
    with farm_up(folder / "data") as farm:
        while farm.client.health().workers != 1:
            time.sleep(0.1)
        time.sleep(SETTLE_S)
        return f"{sum(map(pss_mb, family_of(farm.process.pid))):.0f} MB"


def family_of(pid: int) -> list[int]:
    """Return a process and all below it."""
    parents = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    family = [pid]
    for member in family:
        family += [child for child, parent in parents.items() if parent == member]
    return family


def cpu_s(pid: int) -> float:
    """Return the CPU seconds that a process has used."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def pss_mb(pid: int) -> float:
    """Return a process's memory, its part of what is shared."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0.0
    return next((int(line.split()[1]) / 1024 for line in lines if line.startswith("Pss:")), 0.0)
