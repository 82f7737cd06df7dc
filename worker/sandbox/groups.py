"""Control groups (cgroups): the memory and the processes of a task together, limited by the kernel.

Each task has a group of its own below a group that was given to the worker: systemd gives one to a service with
`Delegate=memory pids`, and the setting `LIPPMANN_CGROUP` names one, of cgroup v2 or of the memory controller of v1. No
other group is touched, also by a worker that is root. Without such a group, the limits of each process remain
(`limits`), and memory is counted several times a second (`totals`).

In cgroup v2 a group with processes has no groups with limits below it, so a worker that systemd has put into its group
moves into a group below that one, with everything else of the service (`make_room`).
"""

from __future__ import annotations

import errno
import logging
import os
import secrets
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import SandboxMissing
from worker.sandbox.limits import Limits
from worker.sandbox.totals import OUR_PROCESSES

log = logging.getLogger(__name__)

OURS_MB = 16
"""The memory of the sandbox itself, which counts in the group of the task."""

_WORKER = "lippmann-worker"
_TASK = "lippmann-task-"
_REMOVE_S = 2.0
"""The time in which the last processes of a group that were killed end."""
_ROUNDS = 100
_MIB = 1024 * 1024

_ENTER_ALL = 'while [ "$1" != -- ]; do echo $$ >"$1/cgroup.procs" || exit 125; shift; done; shift; exec "$@"'


@dataclass(frozen=True)
class NoGroups:
    """No group was given to this worker."""

    reason: str
    was_given: bool = False
    """True if there is a group that was given to this worker, which does not work."""


@dataclass(frozen=True)
class TaskGroup:
    """The group of one task."""

    folders: tuple[Path, ...]
    """One folder in cgroup v2, and one of each controller in v1."""

    def entering(self, argv: Sequence[str]) -> list[str]:
        """Return the command line that runs `argv` in this group: it enters the group before it becomes the program."""
        return ["/bin/sh", "-c", _ENTER_ALL, "enter", *map(str, self.folders), "--", *argv]

    def cpu_s(self) -> float:
        """Return the CPU seconds of all processes that were in the group, also of those that nobody waited for.

        It is 0 in cgroup v1.
        """
        return _counts(self.folders[0] / "cpu.stat").get("usage_usec", 0) / 1e6

    def ran_out_of_memory(self) -> bool:
        """Return whether the kernel has ended a process of the group because the group is at its own limit."""
        return any(_killed_at_own_limit(folder) for folder in self.folders)


@dataclass(frozen=True)
class Groups:
    """A group that was given to this worker, for the groups of its tasks."""

    folders: tuple[Path, ...]
    """One folder in cgroup v2, and one of each controller in v1."""

    @contextmanager
    def task(self, limits: Limits) -> Iterator[TaskGroup]:
        """Make a group for a task with its limits, and remove it with all processes in it.

        Raises
        ------
        SandboxMissing
            If the group cannot be made.
        """
        name = f"{_TASK}{_namespace()}-{os.getpid()}-{secrets.token_hex(6)}"
        group = TaskGroup(tuple(folder / name for folder in self.folders))
        try:
            try:
                for folder in group.folders:
                    folder.mkdir()
                    _limit(folder, limits)
            except OSError as error:
                raise SandboxMissing(f"expected a cgroup for a task below {self.folders[0]}, got: {error}") from error
            yield group
        finally:
            for folder in group.folders:
                _remove(folder)

    def remove_stale(self) -> None:
        """Remove the groups of tasks whose worker has ended; a group with processes stays.

        The groups of workers in other PID namespaces stay too: their process numbers mean nothing here.
        """
        own = f"{_TASK}{_namespace()}-"
        for folder in self.folders:
            for group in folder.glob(f"{own}*"):
                pid = group.name.removeprefix(own).partition("-")[0]
                if not Path("/proc", pid).exists():
                    with suppress(OSError):
                        group.rmdir()


def _namespace() -> str:
    """Return the name of the namespace in which the process numbers of this process hold: its boot and its inode."""
    boot = Path("/proc/sys/kernel/random/boot_id").read_text()[:8]
    return f"{boot}-{os.stat('/proc/self/ns/pid').st_ino}"


def find_groups(wanted: str) -> Groups | NoGroups:
    """Return the group that was given to this worker, after a trial with a program.

    Parameters
    ----------
    wanted
        `auto` for the group of a service of systemd, `none`, or the folder of a group.

    Raises
    ------
    SandboxMissing
        If the folder is not of a group in which this worker may make others with limits of memory.
    """
    if wanted == "none":
        return NoGroups("LIPPMANN_CGROUP is none")
    if wanted == "auto":
        own = own_group()
        if own is None or own.name != _WORKER or not _is_given(own.parent):
            return NoGroups("the worker is in no cgroup that was delegated to it")
        found = _tried((own.parent,))
        return found if isinstance(found, Groups) else NoGroups(f"{own.parent}: {found}", was_given=True)
    folder = Path(wanted)
    pids = _beside(folder, "pids")
    found = _tried((folder,) if pids is None else (folder, pids))
    if isinstance(found, str):
        raise SandboxMissing(f"LIPPMANN_CGROUP: expected a cgroup for the groups of tasks, got {wanted}: {found}")
    return found


def make_room() -> None:
    """Move this process and all others of its group into a group below, if its group was given to this service."""
    own = own_group()
    # The group of a container is its mount; programs that are started in the container later need it as it is.
    if own is None or own.is_mount() or not _is_given(own):
        return
    try:
        _move_all(own, own / _WORKER)
    except OSError as error:
        log.warning("the cgroup %s is not used, because its processes cannot move below it: %s", own, error)


def _move_all(group: Path, below: Path) -> None:
    below.mkdir(exist_ok=True)
    for _ in range(_ROUNDS):
        pids = (group / "cgroup.procs").read_text().split()
        if not pids:
            return
        for pid in pids:
            with suppress(ProcessLookupError):
                (below / "cgroup.procs").write_text(pid)
    raise TimeoutError(f"it still has the processes {' '.join(pids)} after {_ROUNDS} rounds")


def own_group(proc: Path = Path("/proc/self")) -> Path | None:
    """Return the folder of the group of cgroup v2 that this process is in."""
    try:
        inside = [line[3:] for line in (proc / "cgroup").read_text().splitlines() if line.startswith("0::")]
        mounts = [line.split() for line in (proc / "mountinfo").read_text().splitlines() if " - cgroup2 " in line]
    except OSError:
        return None
    for root, place in (mount[3:5] for mount in mounts):
        if inside and Path(inside[0]).is_relative_to(root):
            return Path(place, Path(inside[0]).relative_to(root))
    return None


def _is_given(folder: Path) -> bool:
    """Return whether systemd has marked a group as one that belongs to its service."""
    for name in ("user.delegate", "trusted.delegate"):
        with suppress(OSError):
            if os.getxattr(folder, name) == b"1":
                return True
    return False


def _tried(folders: tuple[Path, ...]) -> Groups | str:
    """Return the groups if a program runs in one of them, or what is wrong."""
    found = Groups(folders)
    try:
        _enable(folders[0])
        with found.task(Limits(cpu_s=5, memory_mb=64)) as group:
            if not any((group.folders[0] / name).exists() for name in ("memory.max", "memory.limit_in_bytes")):
                return f"{folders[0]} has no controller of memory"
            subprocess.run(group.entering(["/bin/true"]), check=True, capture_output=True, timeout=60)
    except SandboxMissing as error:
        return error.message
    except subprocess.CalledProcessError as error:
        return error.stderr.decode(errors="replace").strip()[:300] or str(error)
    except (OSError, subprocess.SubprocessError) as error:
        return str(error)
    return found


def _enable(folder: Path) -> None:
    """Let the groups below a group of cgroup v2 have limits."""
    control = folder / "cgroup.subtree_control"
    if control.exists():
        there, enabled = (set(path.read_text().split()) for path in (folder / "cgroup.controllers", control))
        control.write_text(" ".join(f"+{name}" for name in ("memory", "pids") if name in there - enabled))


def _beside(folder: Path, controller: str) -> Path | None:
    """Return the folder of the same name of another controller of cgroup v1."""
    if "memory" not in folder.parts or (folder / "cgroup.controllers").exists():
        return None
    place = folder.parts.index("memory")
    found = Path(*folder.parts[:place], controller, *folder.parts[place + 1 :])
    return found if os.access(found, os.W_OK) else None


def _limit(folder: Path, limits: Limits) -> None:
    memory = (limits.memory_mb + OURS_MB) * _MIB
    wanted = {
        "memory.max": memory,
        "memory.swap.max": 0,
        "memory.oom.group": 1,
        "memory.limit_in_bytes": memory,
        "memory.memsw.limit_in_bytes": memory,
        "pids.max": limits.processes + OUR_PROCESSES,
    }
    for name, value in wanted.items():
        if (folder / name).exists():
            (folder / name).write_text(str(value))


def _killed_at_own_limit(folder: Path) -> bool:
    """Return whether a group has reached its own limit of memory, and a process of it was killed.

    `oom_kill` alone also counts processes that were killed because the machine or a group above had no memory left.
    In cgroup v1, the limit also counts as reached where the kernel then found memory to free.
    """
    counts = _counts(folder / "memory.events.local") or _counts(folder / "memory.events")
    at_limit = counts.get("oom", 0)
    if not counts:  # cgroup v1
        counts = _counts(folder / "memory.oom_control")
        at_limit = sum(_counts(folder / f"memory.{kind}failcnt").get("", 0) for kind in ("", "memsw."))
    return at_limit > 0 and counts.get("oom_kill", 0) > 0


def _counts(path: Path) -> dict[str, int]:
    """Return the named numbers of a file of a group, and a number alone without a name; none if there is no file."""
    with suppress(OSError):
        pairs = (line.rpartition(" ") for line in path.read_text().splitlines())
        return {name: int(number) for name, _, number in pairs}
    return {}


def _remove(folder: Path) -> None:
    """Remove a group; what is still in it is killed. One that cannot be removed is left for the next start."""
    ends_s = time.monotonic() + _REMOVE_S
    while True:
        try:
            folder.rmdir()
        except OSError as error:
            if error.errno != errno.EBUSY or time.monotonic() > ends_s:
                return
            _kill(folder)
            time.sleep(0.01)
        else:
            return


def _kill(folder: Path) -> None:
    with suppress(OSError):
        for pid in (folder / "cgroup.procs").read_text().split():
            os.kill(int(pid), signal.SIGKILL)
