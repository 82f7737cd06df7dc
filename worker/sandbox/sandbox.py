"""The sandbox around a foreign program, because the file security of POV-Ray does nothing.

========= ====================================================================== ==========================
mode      holds                                                                  needs
========= ====================================================================== ==========================
bwrap     files, network, processes, IPC: namespaces with nothing else in them   user namespaces
landlock  files and TCP; no new processes                                        Linux 5.13, no privilege
none      nothing but limits; for built-in scenes and one's                      nothing
          own files, never for scenes that were uploaded
========= ====================================================================== ==========================

In the first two, the program has no capabilities and no new privileges, a filter of system calls (`seccomp`) takes away
sockets, links and much of the kernel, and if the worker is root, the program runs as a user of its own. In each of them
it dies with the thread that started it, and only the task's folder can be written: there is no other room, not even
a temporary one in memory.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from lippmann.errors import SandboxMissing
from worker.sandbox import landlock
from worker.sandbox.devices import Devices
from worker.sandbox.groups import Groups
from worker.sandbox.limits import Limits, limited
from worker.sandbox.own_user import hand_over, is_open_to_all, let_read, own_user
from worker.sandbox.seccomp import filter_path

SandboxMode = Literal["bwrap", "landlock", "none"]

PATH = "/usr/local/bin:/usr/bin:/bin"
"""The search path inside the sandbox."""

COMPLAINTS = ("bwrap: ", "landlock: ", "setpriv: ", "sandbox: ", "enter: ")
"""The beginnings of lines of output by which a program of the sandbox says that it did not start. The program `enter`
is the one that enters the group of the task."""

_REAPER = ["/bin/sh", "-c", '"$@"; exit $?', "sh"]
"""Process 1 of the namespace. As process 1, POV-Ray would not end on SIGXCPU or SIGXFSZ; and bwrap's own process 1 is
not waited for, so that the CPU seconds of POV-Ray would be lost."""

_WITH_FILTER = ["/bin/sh", "-c", 'exec 9<"$1"; shift; exec "$@"', "sandbox"]
"""bwrap reads the filter of system calls from an open file."""


@dataclass(frozen=True)
class Sandbox:
    """The sandbox that works on this machine."""

    mode: SandboxMode
    allow_none: bool = False
    """True for built-in scenes and for the files of the person who runs the command; whatever
    else is handled in the mode `none` is refused."""
    groups: Groups | None = None
    """The place of the group of each task; None where the kernel limits each process alone."""
    unused_group: str = ""
    """Why a group that was given to the worker, or that its settings name, is not used; empty if nothing was given."""

    @property
    def text(self) -> str:
        """The mode, and whether tasks have groups.

        >>> Sandbox("bwrap").text
        'bwrap'
        """
        return self.mode if self.groups is None else f"{self.mode}+cgroup"

    def wrap(
        self,
        argv: Sequence[str],
        *,
        readable: Sequence[Path],
        writable: Path,
        limits: Limits,
        devices: Devices | None = None,
    ) -> list[str]:
        """Return the command line that runs `argv` inside; it may read `readable`, and it works in `writable`.

        It uses `devices` as well, if any are given; see there what it then may do besides.

        The command line is for a child of this process. If this process is root, `writable` and what is in it is given
        to the user that the program runs as, and of `readable`, what is closed to others is opened to this user.

        Raises
        ------
        SandboxMissing
            If the mode is `none` and the scene is somebody else's.
        ValueError
            If a path is not absolute, or a readable one lies in the writable one.
        """
        _check_paths(readable, writable)
        if devices is not None:
            limits = replace(limits, address_space=False)
        if self.mode == "none":
            if not self.allow_none:
                raise SandboxMissing(
                    "expected a worker with a sandbox for an uploaded scene, got one without: it renders only the "
                    "built-in scenes"
                )
            return ["setpriv", "--pdeathsig", "KILL", "--no-new-privs", "--", *limited(argv, limits, processes=None)]
        user = own_user(writable)
        if self.mode == "landlock" and user is not None and not is_open_to_all((*readable, writable)):
            user = None
        if user is not None:
            hand_over(writable, user)
            for path in readable:
                let_read(path, user)
        if self.mode == "bwrap":
            return [*_bwrap(readable, writable, user, devices), *_REAPER, *_as_user(user), *limited(argv, limits)]
        # The kernel counts all processes of a user, so a limit would count those of the worker.
        counted = limits.processes if user is not None else None
        return [*_landlock(readable, writable, user, devices), *limited(argv, limits, processes=counted)]


def _bwrap(readable: Sequence[Path], writable: Path, user: int | None, devices: Devices | None) -> list[str]:
    mounts = [("--ro-bind", path) for path in readable] + [("--bind", writable)]
    if devices is not None:
        mounts += [("--dev-bind", path) for path in devices.files]
        mounts += [("--ro-bind", path) for path in devices.described_in]
    # A folder inside another is mounted after it.
    mounts.sort(key=lambda mount: (len(mount[1].parts), mount[1]))
    return [
        *_WITH_FILTER,
        filter_path(forks=True, maps_shared=devices is not None),
        "bwrap",
        *("--seccomp", "9"),
        *_namespaces(user),
        "--die-with-parent",
        "--new-session",
        "--as-pid-1",
        *("--ro-bind", "/usr", "/usr"),
        *(word for path in landlock.SYSTEM[1:] for word in ("--ro-bind-try", path, path)),
        *("--ro-bind-try", "/etc/ld.so.cache", "/etc/ld.so.cache"),
        *("--dev", "/dev"),
        *_folders_above(path for _, path in mounts),
        *(word for option, path in mounts for word in (option, str(path), str(path))),
        # Both are in memory, and what is written there counts for no limit.
        *("--remount-ro", "/dev"),
        *("--remount-ro", "/"),
        *("--chdir", str(writable)),
        "--",
    ]


def _folders_above(paths: Iterable[Path]) -> Iterator[str]:
    """Yield the options that make the folders above some paths; bwrap would make them for its own user alone."""
    above = {folder for path in paths for folder in path.parents if folder != Path("/dev")}
    for folder in sorted(above - {Path("/")}, key=lambda folder: (len(folder.parts), folder)):
        if not any(folder.is_relative_to(system) for system in landlock.SYSTEM):
            yield from ("--dir", str(folder))


def _namespaces(user: int | None) -> list[str]:
    if user is None:
        return ["--unshare-all", "--cap-drop", "ALL"]
    # In a user namespace of bwrap, root would stay root for the kernel. Process 1 keeps what changes the user.
    spaces = ("ipc", "pid", "net", "uts", "cgroup-try")
    rights = ["--cap-drop", "ALL", "--cap-add", "CAP_SETUID", "--cap-add", "CAP_SETGID"]
    return [*(f"--unshare-{space}" for space in spaces), *rights]


def _as_user(user: int | None) -> list[str]:
    if user is None:
        return []
    ids = [f"--reuid={user}", f"--regid={user}", "--clear-groups"]
    return ["setpriv", *ids, "--inh-caps=-all", "--no-new-privs", "--"]


def _landlock(readable: Sequence[Path], writable: Path, user: int | None, devices: Devices | None) -> list[str]:
    options = ["--filter", filter_path(forks=False, maps_shared=devices is not None)]
    options += [] if user is None else ["--user", str(user)]
    read = (*readable, *(() if devices is None else devices.described_in))
    options += [word for path in read for word in ("--read", str(path))]
    options += [word for path in (() if devices is None else devices.files) for word in ("--device", str(path))]
    return [sys.executable, "-I", "-S", landlock.__file__, *options, "--write", str(writable), "--"]


def _check_paths(readable: Sequence[Path], writable: Path) -> None:
    for path in (*readable, writable):
        if not path.is_absolute():
            raise ValueError(f"expected absolute paths for the sandbox, got {path}")
    for path in readable:
        # Landlock adds rights up along the path, so such a folder would be writable.
        if path.is_relative_to(writable):
            raise ValueError(f"expected read-only paths outside the writable {writable}, got {path}")
