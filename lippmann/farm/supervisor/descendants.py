"""The processes below this one, which must not outlive it. Linux only (prctl, /proc)."""

from __future__ import annotations

import ctypes
import os
import signal
import time
from collections.abc import Callable, Iterator, Set
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_PR_SET_CHILD_SUBREAPER = 36

_LIBC = ctypes.CDLL(None, use_errno=True)


def adopt_orphans() -> None:
    """Let orphans below this process become its children instead of children of init."""
    _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def dying_with(parent: int) -> Callable[[], None]:
    """Return a function for a new child to call, so that the kernel kills the child when `parent` dies."""

    def prepare() -> None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # The parent died before the call.
            os._exit(1)

    return prepare


def descendants(pid: int) -> set[int]:
    """Return every process below a process, without the process itself."""
    children: dict[int, list[int]] = {}
    for child, parent in _parents():
        children.setdefault(parent, []).append(child)
    found: set[int] = set()
    rest = [pid]
    while rest:
        for child in children.get(rest.pop(), ()):
            if child not in found:
                found.add(child)
                rest.append(child)
    return found


def kill(pids: Set[int]) -> None:
    """Kill those of the processes that exist."""
    for pid in pids:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue


def kill_all_below(*, within_s: float = 5.0) -> bool:
    """Kill and reap every process below this one; return whether none is left."""
    until = time.monotonic() + within_s
    while time.monotonic() < until:
        kill(descendants(os.getpid()))
        if not _reap():
            return True
        time.sleep(0.01)  # Killed processes end soon, and new orphans arrive as their parents end.
    return False


def _reap() -> bool:
    """Reap the children that have ended; return whether any are left."""
    try:
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
    except ChildProcessError:
        return False
    return True


def _parents() -> Iterator[tuple[int, int]]:
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text("utf-8", "replace")
            except OSError:  # The process has ended meanwhile.
                continue
            # The line is "pid (name) state parent ...", and the name may hold spaces and brackets.
            yield int(entry.name), int(stat.rpartition(")")[2].split()[1])
