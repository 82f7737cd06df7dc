"""Nothing that a test run started outlives it, however the run ends: by Ctrl-C, by SIGKILL, when memory runs out.

Every process that loads tests/conftest.py marks its environment, which the processes below it inherit, and starts a
watcher. The watcher waits for the end of the test run, and then kills every process with the mark and all below them.
A program that overwrites its environment, such as Valkey, is started with `dying_with` instead.
"""

from __future__ import annotations

import os
import secrets
import select
import subprocess
import sys
import time
from pathlib import Path

from lippmann.farm.supervisor.descendants import descendants, kill

MARK = "LEFT_BY_TEST_RUNS"
"""The variable that names every test run above a process; a test run may start another."""


def watch_this_run() -> None:
    """Mark what this process starts from now on, and have it killed once this process has ended."""
    run = f"{os.getpid()}-{secrets.token_hex(8)}"
    command = [sys.executable, "-P", __file__, str(os.getpid()), run]
    # Started before the mark is set: the watcher does not kill itself. It returns once it watches.
    subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, check=True, cwd="/")
    os.environ[MARK] = f"{os.environ.get(MARK, '')} {run}".strip()


def marked(run: str) -> set[int]:
    """Return the processes that a test run started, and all below them."""
    found = {int(folder.name) for folder in Path("/proc").iterdir() if folder.name.isdigit() and _has(folder, run)}
    return found.union(*map(descendants, found))


def _has(process: Path, run: str) -> bool:
    try:
        variables = (process / "environ").read_bytes().split(b"\0")
    except OSError:  # it ended, or is another user's
        return False
    return any(one.startswith(f"{MARK}=".encode()) and run.encode() in one for one in variables)


def _watch(pid: int, run: str) -> None:
    watched = os.pidfd_open(pid)
    if os.fork():
        os._exit(0)
    # A session of its own, and no child of the run: what ends the run and everything below it does not end the watcher.
    os.setsid()
    select.select([watched], [], [])
    while left := marked(run):
        kill(left)
        time.sleep(0.01)  # killed processes end soon; some have just started others


if __name__ == "__main__":
    _watch(int(sys.argv[1]), sys.argv[2])
