"""Find the sandbox that holds on this machine, by a real program that tries to break out of it."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import cache
from pathlib import Path
from typing import Literal

from lippmann.errors import SandboxMissing
from worker.sandbox import breakout
from worker.sandbox.groups import Groups, find_groups
from worker.sandbox.limits import Limits
from worker.sandbox.sandbox import PATH, Sandbox, SandboxMode

TRIAL_S = 60.0
"""The longest time of a trial, which takes a tenth of a second on an idle machine."""

_MODES: tuple[SandboxMode, ...] = ("bwrap", "landlock")
_LIMITS = Limits(cpu_s=20, memory_mb=512, file_mb=1)


def detect(wanted: SandboxMode | Literal["auto"], *, cgroup: str = "none") -> Sandbox:
    """Return the sandbox to use: the required one, or the best that works here.

    It is found by trying, so call this once, or `detect_once`.

    `auto` on a machine where no sandbox works gives mode `none`. The setting never allows an uploaded scene to run
    without a sandbox: `allow_none` depends on whose scene it is.

    Parameters
    ----------
    cgroup
        The group below which each task gets one of its own; see `find_groups`.

    Raises
    ------
    SandboxMissing
        If the wanted one does not hold here; the message says what a program inside it could do. Also if none can be
        tried, because no temporary folder can be made, and if the group is a folder in which no groups can be made.
    """
    nothing = Sandbox("none", unused_group=_without_sandbox(cgroup))
    if wanted == "none":
        return nothing
    faults = {}
    for mode in _MODES if wanted == "auto" else (wanted,):
        try:
            fault = trial(Sandbox(mode))
        except OSError as error:
            raise SandboxMissing(
                f"expected a temporary folder and sockets to try a sandbox with, got: {error}"
            ) from error
        if fault is None:
            found = find_groups(cgroup)
            if isinstance(found, Groups):
                return Sandbox(mode, groups=found)
            return Sandbox(mode, unused_group=found.reason if found.was_given else "")
        faults[mode] = fault
    if wanted == "auto":
        return nothing
    raise SandboxMissing(f"Sandbox {wanted} does not hold on this machine: {faults[wanted]}")


@cache
def detect_once(wanted: SandboxMode | Literal["auto"], *, cgroup: str = "none") -> Sandbox:
    """Return what `detect` finds the first time, also in the processes that are forked later.

    A trial in each of them could fail for a reason that passes, such as a full disk or a full list of processes, and
    the process would refuse scenes for the rest of its life.
    """
    return detect(wanted, cgroup=cgroup)


def _without_sandbox(cgroup: str) -> str:
    return "" if cgroup in ("auto", "none") else f"LIPPMANN_CGROUP is {cgroup}, and no sandbox holds that would use it"


def trial(sandbox: Sandbox) -> str | None:
    """Return what is wrong with a sandbox on this machine, or None if it holds: a program tries to break out."""
    with tempfile.TemporaryDirectory(prefix="lippmann-trial-") as name, _aims(Path(name)) as aims:
        inside = Path(name, "task")
        inside.mkdir()
        argv = [*python_inside(), breakout.__file__, *aims]
        readable = [*python_folders(), Path(breakout.__file__), Path(name, "readable")]
        try:
            line = sandbox.wrap(argv, readable=readable, writable=inside, limits=_LIMITS)
            ran = subprocess.run(
                line, cwd=inside, env={"PATH": PATH}, stdin=subprocess.DEVNULL, capture_output=True, timeout=TRIAL_S
            )
        except (OSError, subprocess.TimeoutExpired, SandboxMissing) as error:
            return str(error)
        if ran.returncode:
            return ran.stderr.decode(errors="replace").strip() or f"it ended with {ran.returncode}"
        done = json.loads(ran.stdout)
        return f"a program inside could: {' '.join(done)}" if done else None


def python_inside() -> list[str]:
    """Return the command that runs this Python in a sandbox without any packages; see `python_folders`."""
    return [os.path.realpath(sys.executable), "-I", "-S"]


def python_folders() -> list[Path]:
    """Return the folders of this Python that a sandbox does not have by itself."""
    base = Path(sys.base_prefix).resolve()
    return [] if base.is_relative_to("/usr") else [base]


@contextmanager
def _aims(folder: Path) -> Iterator[list[str]]:
    """Yield the arguments of the breakout: what it could reach if nothing held it."""
    secret, readable = folder / "outside", folder / "readable"
    secret.write_text("secret")
    readable.mkdir()
    for path in (folder, readable):
        path.chmod(0o777)
    secret.chmod(0o666)
    with ExitStack() as stack:
        tcp = stack.enter_context(socket.create_server(("127.0.0.1", 0)))
        udp = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        udp.bind(("127.0.0.1", 0))
        unix = stack.enter_context(socket.socket(socket.AF_UNIX))
        unix.bind(str(folder / "socket"))
        unix.listen()
        abstract = stack.enter_context(socket.socket(socket.AF_UNIX))
        abstract.bind(f"\0{folder}")
        abstract.listen()
        aims = {
            "secret": secret,
            "readable": readable,
            "tcp": tcp.getsockname()[1],
            "udp": udp.getsockname()[1],
            "unix": folder / "socket",
            "abstract": folder,
            "pid": os.getpid(),
            "processes": _LIMITS.processes,
            "memory": _LIMITS.memory_mb * 1024 * 1024,
        }
        yield [str(word) for pair in aims.items() for word in pair]
