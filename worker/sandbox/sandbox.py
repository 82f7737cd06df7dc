"""The sandbox around a foreign program, because the file security of POV-Ray does nothing.

========= ====================================================================== ==========================
mode      holds                                                                  needs
========= ====================================================================== ==========================
bwrap     files, network, processes, IPC: namespaces with nothing else in them   user namespaces
landlock  files and TCP; no new privileges, no capabilities                      Linux 5.13, no privilege
none      nothing but limits; for scenes that come with the project and one's    nothing
          own files, never for scenes that were uploaded
========= ====================================================================== ==========================

In each of them POV-Ray dies with the thread that started it, and only the task's folder can be written.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from lippmann.errors import SandboxMissing
from worker.sandbox import landlock
from worker.sandbox.limits import Limits, limited

SandboxMode = Literal["bwrap", "landlock", "none"]

PATH = "/usr/local/bin:/usr/bin:/bin"
"""The search path inside the sandbox."""

TMP_BYTES = 64 * 1024 * 1024
"""The size of /tmp inside bwrap; the temporary folder of POV-Ray is in the folder of the task."""

TRIAL_S = 20.0

_MODES: tuple[SandboxMode, ...] = ("bwrap", "landlock")
_TRIAL_LIMITS = Limits(cpu_s=10, memory_mb=1024, file_mb=1)
_TRIAL = 'cat "$1" 2>/dev/null && exit 9; (echo out >>"$1") 2>/dev/null; echo in >"$2"'
"""A trial: reading outside must fail, writing outside must change nothing, and writing inside must work."""

_REAPER = ["/bin/sh", "-c", '"$@"; exit $?', "sh"]
"""Process 1 of the namespace. As process 1, POV-Ray would not end on SIGXCPU or SIGXFSZ; and bwrap's own process 1 is
not waited for, so that the CPU seconds of POV-Ray would be lost."""


@dataclass(frozen=True)
class Sandbox:
    """The sandbox that works on this machine."""

    mode: SandboxMode
    allow_none: bool = False
    """True for the scenes that come with the project and for the files of the person who runs the command; whatever
    else is handled in the mode `none` is refused."""

    def wrap(self, argv: Sequence[str], *, readable: Sequence[Path], writable: Path, limits: Limits) -> list[str]:
        """Return the command line that runs `argv` inside; it may read `readable`, and it works in `writable`.

        Raises
        ------
        SandboxMissing
            If the mode is `none` and the scene is somebody else's.
        ValueError
            If a path is not absolute, or a readable one lies in the writable one.
        """
        _check_paths(readable, writable)
        if self.mode == "bwrap":
            inside = limited(argv, limits, counted_alone=True)
            return [*_bwrap(readable, writable), *_REAPER, *inside]
        if self.mode == "landlock":
            return [*_landlock(readable, writable), *limited(argv, limits, counted_alone=False)]
        if not self.allow_none:
            raise SandboxMissing(
                "expected a worker with a sandbox for an uploaded scene, got one without: it renders only the scenes "
                "that come with the project"
            )
        return ["setpriv", "--pdeathsig", "KILL", "--no-new-privs", "--", *limited(argv, limits, counted_alone=False)]


def detect(wanted: SandboxMode | Literal["auto"]) -> Sandbox:
    """Return the sandbox to use: the required one, or the best that works here.

    It is found by trying, so call this once.

    `auto` on a machine where no sandbox works gives mode `none`. The setting never allows an uploaded scene to run
    without a sandbox: `allow_none` depends on whose scene it is.

    Raises
    ------
    SandboxMissing
        If the wanted one does not hold here; the message says what it answered.
    """
    if wanted == "none":
        return Sandbox("none")
    faults = {}
    for mode in _MODES if wanted == "auto" else (wanted,):
        fault = trial(Sandbox(mode))
        if fault is None:
            return Sandbox(mode)
        faults[mode] = fault
    if wanted == "auto":
        return Sandbox("none")
    raise SandboxMissing(f"Sandbox {wanted} does not hold on this machine: {faults[wanted]}")


def trial(sandbox: Sandbox) -> str | None:
    """Return what is wrong with a sandbox on this machine, or None if it holds: a real run that tries to get out."""
    with tempfile.TemporaryDirectory(prefix="lippmann-trial-") as folder:
        outside, inside = Path(folder, "outside"), Path(folder, "task")
        outside.write_text("secret")
        inside.mkdir()
        script = ["/bin/sh", "-c", _TRIAL, "sh", str(outside), str(inside / "written")]
        argv = sandbox.wrap(script, readable=[], writable=inside, limits=_TRIAL_LIMITS)
        try:
            ran = subprocess.run(
                argv, cwd=inside, env={"PATH": PATH}, stdin=subprocess.DEVNULL, capture_output=True, timeout=TRIAL_S
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            return str(error)
        if ran.returncode == 0 and (inside / "written").exists() and outside.read_text() == "secret":
            return None
        return ran.stderr.decode(errors="replace").strip() or f"it let a file outside be touched ({ran.returncode})"


def _bwrap(readable: Sequence[Path], writable: Path) -> list[str]:
    mounts = [("--ro-bind", path) for path in readable] + [("--bind", writable)]
    # A folder inside another is mounted after it.
    mounts.sort(key=lambda mount: (len(mount[1].parts), mount[1]))
    return [
        "bwrap",
        "--unshare-all",
        "--die-with-parent",
        "--new-session",
        "--as-pid-1",
        *("--cap-drop", "ALL"),
        *("--ro-bind", "/usr", "/usr"),
        *(word for path in landlock.SYSTEM[1:] for word in ("--ro-bind-try", path, path)),
        *("--ro-bind-try", "/etc/ld.so.cache", "/etc/ld.so.cache"),
        *("--dev", "/dev"),
        *("--size", str(TMP_BYTES), "--tmpfs", "/tmp"),  # noqa: S108 - inside the namespace no other process has it
        *(word for option, path in mounts for word in (option, str(path), str(path))),
        *("--chdir", str(writable)),
        "--",
    ]


def _landlock(readable: Sequence[Path], writable: Path) -> list[str]:
    reads = [word for path in readable for word in ("--read", str(path))]
    return [sys.executable, "-I", "-S", landlock.__file__, *reads, "--write", str(writable), "--"]


def _check_paths(readable: Sequence[Path], writable: Path) -> None:
    for path in (*readable, writable):
        if not path.is_absolute():
            raise ValueError(f"expected absolute paths for the sandbox, got {path}")
    for path in readable:
        # Landlock adds rights up along the path, so such a folder would be writable.
        if path.is_relative_to(writable):
            raise ValueError(f"expected read-only paths outside the writable {writable}, got {path}")
