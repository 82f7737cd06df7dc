"""A real `lippmann up`, and everything below it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from lippmann.client import Client
from lippmann.client.address import Address
from lippmann.farm.supervisor.descendants import descendants
from tests.needs import need_to_run
from tests.waiting import ENOUGH_S

LIPPMANN = (sys.executable, "-P", "-m", "lippmann.cli.main")

Process = tuple[int, str]
"""A process id and when it started, so that a number used anew is not taken for the old one."""


@dataclass
class Up:
    """A farm that `lippmann up` runs."""

    process: subprocess.Popen[str]
    data_dir: Path
    said: dict[str, Any]

    @property
    def address(self) -> Address:
        farm = json.loads((self.data_dir / "farm.json").read_text())
        return Address(farm["url"], farm["key"])

    def client(self, **options: Any) -> Client:
        return Client(self.address.url, self.address.key, **options)

    def below(self) -> dict[Process, str]:
        """Return every process of the farm, with its command line."""
        return {found: line for pid in descendants(self.process.pid) if (found := born(pid)) and (line := command(pid))}

    def one(self, words: str) -> int:
        """Return the highest process of the farm whose command line holds these words."""
        return min(pid for (pid, _), line in self.below().items() if words in line)

    def end(self, number: int = signal.SIGINT) -> int:
        self.process.send_signal(number)
        return self.process.wait(timeout=ENOUGH_S)


@contextmanager
def lippmann_up(data_dir: Path, *options: str, through: Sequence[str] = ()) -> Iterator[Up]:
    """Run a farm; `through` is the beginning of a command line that starts it."""
    command = [*through, *LIPPMANN, "up", "--json", "--port", "0", "--slots", "2"]
    process = subprocess.Popen([*command, "--data-dir", str(data_dir), *options], stdout=subprocess.PIPE, text=True)
    try:
        assert process.stdout is not None
        line = process.stdout.readline()
        assert line, f"lippmann up ended with {process.wait()}"
        yield Up(process, data_dir, json.loads(line))
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGTERM)
            process.wait(timeout=ENOUGH_S)
        if process.stdout:
            process.stdout.close()


@pytest.fixture(scope="package")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Up]:
    """A farm for tests that do not kill it."""
    with lippmann_up(tmp_path_factory.mktemp("farm")) as up:
        yield up


@pytest.fixture(scope="session")
def bwrap() -> list[str]:
    """Lend the beginning of a command line that sees other mounts than this process does."""
    command = ["bwrap", "--dev-bind", "/", "/"]
    need_to_run([*command, "--tmpfs", "/tmp", "--", "true"], what="bubblewrap cannot make a mount namespace here")
    return command


def run(*arguments: str, given: str = "", **environment: str) -> subprocess.CompletedProcess[str]:
    """Run a command to its end."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("LIPPMANN_")}
    return subprocess.run(
        [*LIPPMANN, *arguments], input=given, capture_output=True, text=True, timeout=300, env=inherited | environment
    )


def born(pid: int) -> Process | None:
    """Return a process that lives; None if it is gone or a zombie."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return None
    return None if fields[0] in "ZX" else (pid, fields[19])


def alive(processes: set[Process]) -> set[Process]:
    """Return those that still live."""
    return {process for process in processes if born(process[0]) == process}


def command(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""
