"""Faults of the program of Mitsuba that a worker keeps in the sandbox, while it renders."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from random import Random

from tests.chaos.kinds.kind import Injection, Kinds, Work, pause
from tests.chaos.parts import Parts, cpu_s, mitsuba_below, stands_still
from tests.waiting import until

KINDS = Kinds()

STALL_S = 60.0
"""The time without progress after which the worker ends the program; a busy machine takes a third of it for a tile."""
STARTED_CPU_S = 1.5
"""The CPU seconds after which a program has started and loads the scene or renders."""

MESHES = Work(frames=6, lenses=40, tiles=2, scene="fish-mesh", samples=8, stall_s=STALL_S)
"""Several rays a pixel, so that the program renders for most of the time."""


def kill(pid: int) -> None:
    """Kill a process."""
    os.kill(pid, signal.SIGKILL)


def halt(pid: int) -> None:
    """Stop a process."""
    os.kill(pid, signal.SIGSTOP)


def starve(pid: int) -> None:
    """Let the kernel refuse a process all further memory."""
    owner = Path(f"/proc/{pid}").stat()
    # Only its own user may lower the limit, if root lacks CAP_SYS_RESOURCE.
    own_user = [f"--reuid={owner.st_uid}", f"--regid={owner.st_gid}", "--clear-groups"] if os.geteuid() == 0 else []
    limit = ["prlimit", f"--pid={pid}", "--as=1:1"]
    subprocess.run(["setpriv", *own_user, "--", *limit] if own_user else limit, check=True)


def hit(worker_pid: int, fault: Callable[[int], None]) -> int:
    """Wait until a program of Mitsuba of a worker has started and works, and do something to it; return its process id.

    Between two requests, the program stands still.
    """

    def done() -> int | None:
        for pid in mitsuba_below(worker_pid):
            if not stands_still(pid) and cpu_s(pid) > STARTED_CPU_S:
                with suppress(ProcessLookupError):
                    fault(pid)
                    return pid
        return None

    return int(until(done))


def _to_mitsuba(fault: Callable[[int], None]) -> Injection:
    def inject(parts: Parts, job_id: str, rng: Random) -> None:
        hit(rng.choice(parts.workers).pid, fault)

    return inject


for _name, _fault in {"SIGKILL": kill, "stands still for good": halt, "out of memory": starve}.items():
    KINDS.add(f"mitsuba: {_name}", _to_mitsuba(_fault), work=MESHES)


@KINDS.of("mitsuba: stands still for 10 s", work=MESHES)
def _paused(parts: Parts, job_id: str, rng: Random) -> None:
    pid = hit(rng.choice(parts.workers).pid, halt)
    pause(rng, 9.0, 11.0)
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGCONT)
