"""What the sandbox adds to a task, beside the program in it."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable
from pathlib import Path

from worker.sandbox.limits import Limits
from worker.sandbox.results import fresh_folder, take_result
from worker.sandbox.sandbox import PATH, Sandbox, SandboxMode

ROUNDS = 30
RESULT_BYTES = 1_000_000
_PROGRAM = ["/bin/sh", "-c", "exec head -c 1000000 /dev/zero > result"]
_LIMITS = Limits(cpu_s=60, memory_mb=512)


def bwrap_ms(folder: Path) -> str:
    """Return the time that bubblewrap adds: the folder, the sandbox, and the result that is taken out."""
    return _added_ms(folder, "bwrap")


def landlock_ms(folder: Path) -> str:
    """Return the time that Landlock adds, likewise."""
    return _added_ms(folder, "landlock")


def _added_ms(folder: Path, mode: SandboxMode) -> str:
    ours = folder / "ours"
    ours.mkdir()

    def bare() -> None:
        subprocess.run(_PROGRAM, cwd=ours, env={"PATH": PATH}, check=True)
        (ours / "result").unlink()

    def held() -> None:
        with fresh_folder(folder / "work") as work:
            line = Sandbox(mode).wrap(_PROGRAM, readable=[], writable=work, limits=_LIMITS)
            subprocess.run(line, cwd=work, env={"PATH": PATH}, check=True)
            taken = take_result(work, "result", into=ours, max_bytes=RESULT_BYTES)
        assert taken is not None
        taken.unlink()

    # In turns, and the best of each: other work on the machine only adds to the time.
    times = [(_seconds(held), _seconds(bare)) for _ in range(ROUNDS)]
    best_held_s, best_bare_s = map(min, zip(*times, strict=True))
    return f"{1000 * (best_held_s - best_bare_s):.0f} ms"


def _seconds(work: Callable[[], None]) -> float:
    started_s = time.monotonic()
    work()
    return time.monotonic() - started_s
