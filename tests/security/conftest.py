"""The sandboxes that hold on this machine, and a room of a task with what it must not reach beside it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.needs import missing
from tests.waiting import until
from worker.sandbox.detect import python_folders, python_inside, trial
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.process import Outcome, run
from worker.sandbox.results import fresh_folder
from worker.sandbox.sandbox import PATH, Sandbox, SandboxMode

RED_TEAM = Path(__file__).with_name("red_team.py")
LIMITS = Limits(cpu_s=60, memory_mb=1024, file_mb=64, disk_mb=32, files=500)


class Silent:
    """A program that reports no progress."""

    progress, phase, growth = 0, "working", 0.0

    def read(self, line: str) -> bool:
        return False


@dataclass
class Task:
    """A task in a sandbox: the folder that it can write, and a folder with everything that it must not reach."""

    work: Path
    outside: Path
    sandbox: Sandbox

    def run(self, attack: str, *arguments: str, limits: Limits = LIMITS) -> Outcome[int]:
        """Run one attack of the red team to its end."""
        argv = [*python_inside(), str(RED_TEAM), attack, *arguments]
        line = self.sandbox.wrap(argv, readable=[*python_folders(), RED_TEAM], writable=self.work, limits=limits)
        limit = TimeLimit(300, "the test")
        with AttemptLog(self.outside / "log.txt") as log:
            return run(
                line,
                cwd=self.work,
                env={"PATH": PATH},
                times=TimeLimits(total=limit, stall=limit),
                reader=Silent(),
                on_progress=lambda _: None,
                should_stop=lambda: False,
                log=log,
                limits=limits,
            )


@pytest.fixture(scope="session")
def faults() -> dict[str, str | None]:
    """Return what is wrong with each sandbox on this machine."""
    modes: tuple[SandboxMode, ...] = ("bwrap", "landlock")
    return {mode: trial(Sandbox(mode)) for mode in modes}


@pytest.fixture(params=["bwrap", "landlock"])
def sandbox(request: pytest.FixtureRequest, faults: dict[str, str | None]) -> Sandbox:
    """Return each of the sandboxes."""
    if faults[request.param]:
        missing(f"{request.param}: {faults[request.param]}")
    return Sandbox(request.param)


@pytest.fixture
def task(sandbox: Sandbox, tmp_path: Path) -> Iterator[Task]:
    """Lend a task; afterwards no process of it is left, and its folder can be removed."""
    outside = tmp_path / "outside"
    outside.mkdir()
    with fresh_folder(tmp_path / "work") as work:
        yield Task(work, outside, sandbox)
        until(lambda: not _processes_in(work))
    assert not work.exists()


def _processes_in(work: Path) -> list[Path]:
    return [process for process in Path("/proc").glob("[0-9]*") if _works_in(process, work)]


def _works_in(process: Path, work: Path) -> bool:
    try:
        return (process / "cwd").readlink().is_relative_to(work)
    except OSError:
        return False
