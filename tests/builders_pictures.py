"""Pictures that tests ask of a process. The module imports little, since the process imports it, too."""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from lippmann.errors import ArtifactBroken, FieldProblem
from service.errors import Invalid

HANGS_S = 1000.0


@dataclass(frozen=True)
class Wanted:
    """A picture that a function makes."""

    run: Callable[[Path], bytes]
    folder: Path
    """A folder for what the test and the process tell each other."""
    sheet_name: str = "sheet"

    def make(self, _pictures: object, _sheets: object, local_path: Callable[[], Path]) -> bytes:
        if self.run is read_twice:
            local_path()
        return read(local_path()) if self.run in (read, read_twice) else self.run(self.folder)


def facts(_: Path) -> bytes:
    """Return what a process knows of itself."""
    known = {
        "pid": os.getpid(),
        "niceness": os.getpriority(os.PRIO_PROCESS, threading.get_native_id()),
        "oom_score_adj": int(Path("/proc/self/oom_score_adj").read_text()),
        "environment": sorted(os.environ),
        "descriptors": sorted(_kinds_of_descriptors()),
    }
    return json.dumps(known).encode()


def _kinds_of_descriptors() -> list[str]:
    kinds = []
    for entry in Path("/proc/self/fd").iterdir():
        with suppress(OSError):  # the descriptor of this very listing
            kinds.append(os.readlink(entry).partition(":")[0])
    return kinds


def read(path: Path) -> bytes:
    """Return what is in the file of the sheet."""
    return path.read_bytes()


def read_twice(path: Path) -> bytes:
    """Ask for the path of the sheet twice."""
    return read(path)


def babble(_: Path) -> bytes:
    """Fail, and tell it in words that the service does not know."""
    vars(sys.modules["__main__"])["_problem"] = lambda _: b'["u: expected"'
    raise KeyError("u")


def pid(_: Path) -> bytes:
    """Return the id of the process."""
    return str(os.getpid()).encode()


def hang(folder: Path) -> bytes:
    """Write the id of the process into a file, and never return."""
    (folder / str(os.getpid())).touch()
    time.sleep(HANGS_S)
    return b""


def meet(folder: Path) -> bytes:
    """Return when two processes are here."""
    (folder / str(os.getpid())).touch()
    while len(list(folder.iterdir())) < 2:
        time.sleep(0.005)
    return str(os.getpid()).encode()


def fill_memory(_: Path) -> bytes:
    """Take more memory than a process may have."""
    return b"x" * (1 << 40)


def refuse(_: Path) -> bytes:
    """Refuse the picture by its field."""
    problem = FieldProblem(field="u", expected="0 to 3", got="4")
    raise Invalid(str(problem), problems=[problem])


def find_damage(_: Path) -> bytes:
    """Find a damaged sheet."""
    raise ArtifactBroken("not whole")


def blunder(_: Path) -> bytes:
    """Fail as no picture should."""
    raise KeyError("a fault of ours")
