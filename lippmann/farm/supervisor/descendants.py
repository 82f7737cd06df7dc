"""Processes below this one: none outlives it. Linux only (prctl, /proc)."""

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
    """Let processes below this one that lose their parent become children of this one, instead of init's."""
    _LIBC.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def dying_with(parent: int) -> Callable[[], None]:
    """Return what a child calls before its program starts, so that the kernel kills it when `parent` dies."""

    def prepare() -> None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:  # it died before the kernel was told
            os._exit(1)

    return prepare


def descendants(pid: int) -> set[int]:
    """Return every process below a process, itself not counted."""
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
    """End processes at once, those that are there."""
    for pid in pids:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            continue


def kill_all_below(*, within_s: float = 5.0) -> bool:
    """End every process below this one, and reap; return whether none is left."""
    until = time.monotonic() + within_s
    while time.monotonic() < until:
        kill(descendants(os.getpid()))
        if not _reap():
            return True
        time.sleep(0.01)  # killed processes end soon; new orphans arrive as their parents end
    return False


def _reap() -> bool:
    """Reap what has ended; return whether children are left."""
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
            except OSError:  # it ended meanwhile
                continue
            # pid (name) state parent ...; the name may hold spaces and brackets
            yield int(entry.name), int(stat.rpartition(")")[2].split()[1])
