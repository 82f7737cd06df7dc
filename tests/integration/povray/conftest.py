"""A folder to render in, with the real POV-Ray in the real sandboxes."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from tests.needs import missing
from tests.waiting import until
from worker.engines.povray.answers.progress import Phase, Progress
from worker.engines.povray.command import RenderCommand
from worker.engines.povray.render import RenderOutcome, render
from worker.sandbox.detect import trial
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.sandbox import Sandbox, SandboxMode

HEAD = """#version 3.7; global_settings { assumed_gamma 1 }
camera { location <0,0,-5> look_at 0 } light_source { <5,5,-5> 1 }
"""
"""Two lines; what a test adds begins in line 3."""
BALL = "sphere { 0, 1 pigment { rgb <1, 0.5, 0.2> } } plane { y, -1 pigment { checker rgb 1 rgb 0.1 } }\n"
ENDLESS_PARSE = "#declare A = 0; #while (A < 1) #declare B = A; #end\n"
ENDLESS_TRACE = """#declare I = 0; union {
#while (I < 400) sphere { <mod(I, 20) / 5 - 2, I / 100 - 2, 0>, 0.3 } #declare I = I + 1; #end
pigment { rgb 1 } finish { reflection 0.5 } }
light_source { <-5, 5, -5> 1 area_light x, y, 40, 40 } plane { y, -3 pigment { rgb 0.5 } }
"""
"""Minutes of work, but a block of 32 x 32 px is done several times a second."""


def times_of(timeout_s: float, stall_s: float, phase_s: float) -> TimeLimits:
    """Return time limits, those of parsing and of photons equal."""
    of_phase = TimeLimit(phase_s, "render.parse_timeout_s")
    return TimeLimits(
        total=TimeLimit(timeout_s, "render.timeout_s"),
        stall=TimeLimit(stall_s, "render.stall_s"),
        phases={Phase.PARSING: of_phase, Phase.PHOTONS: of_phase},
    )


@dataclass
class Room:
    """A task's folder, a bundle beside it, and what was heard of the last render."""

    task_dir: Path
    bundle: Path
    sandbox: Sandbox
    heard: list[Progress] = field(default_factory=list)

    def write(self, text: str) -> None:
        (self.task_dir / "tile.pov").write_text(HEAD + text)

    def render(self, text: str | None = None, **changed: Any) -> RenderOutcome:
        """Render a scene small, under generous limits, or as `changed` says."""
        if text is not None:
            self.write(text)
        size = {"cols": changed.pop("cols", 64), "rows": changed.pop("rows", 48)}
        command: dict[str, Any] = {
            name: changed.pop(name)
            for name in ("region", "clock", "declares", "picture_format", "program", "picture")
            if name in changed
        }
        command = {"picture": "tile.exr", **size, **command}
        asked = RenderCommand("tile.pov", library_paths=(self.bundle,), **command)
        settings: dict[str, Any] = {
            "task_dir": self.task_dir,
            "readable": [self.bundle],
            "sandbox": self.sandbox,
            "limits": Limits(cpu_s=120, memory_mb=1024, file_mb=64),
            "times": times_of(
                changed.pop("timeout_s", 120.0), changed.pop("stall_s", 60.0), changed.pop("phase_s", 90.0)
            ),
            "on_progress": self.heard.append,
            "should_stop": lambda: False,
        }
        with AttemptLog(self.log) as log:
            return render(asked, **{**settings, "log": log, **changed})

    @property
    def log(self) -> Path:
        return self.task_dir.parent / "log.txt"

    def processes(self) -> list[int]:
        """Return every process whose command line names this task's folder, or whose home it is."""
        return [pid for pid in map(int, filter(str.isdigit, os.listdir("/proc"))) if self._is_ours(pid)]

    def povray(self) -> int:
        """Return the process of POV-Ray itself."""
        return next(pid for pid in self.processes() if Path(f"/proc/{pid}/comm").read_text() == "povray\n")

    def _is_ours(self, pid: int) -> bool:
        try:
            return str(self.task_dir).encode() in Path(f"/proc/{pid}/environ").read_bytes()
        except OSError:
            return False


@pytest.fixture(scope="session", autouse=True)
def _povray_is_here() -> None:
    if shutil.which("povray") is None:
        missing("POV-Ray is not installed")


@pytest.fixture(scope="session")
def faults() -> dict[str, str | None]:
    """Return what is wrong with each sandbox on this machine."""
    modes: tuple[SandboxMode, ...] = ("bwrap", "landlock")
    return {mode: trial(Sandbox(mode)) for mode in modes}


def _room(tmp_path: Path, sandbox: Sandbox) -> Room:
    room = Room(tmp_path / "task", tmp_path / "bundle", sandbox)
    room.task_dir.mkdir()
    room.bundle.mkdir()
    return room


@pytest.fixture(params=["bwrap", "landlock"])
def held(request: pytest.FixtureRequest, tmp_path: Path, faults: dict[str, str | None]) -> Iterator[Room]:
    """Lend a room in each of the sandboxes, and see that nothing is left of it."""
    if faults[request.param]:
        missing(f"{request.param}: {faults[request.param]}")
    room = _room(tmp_path, Sandbox(request.param))
    yield room
    until(lambda: not room.processes())


@pytest.fixture(params=["bwrap", "landlock", "none"])
def room(request: pytest.FixtureRequest, tmp_path: Path, faults: dict[str, str | None]) -> Iterator[Room]:
    """Lend a room in each mode, and see that nothing is left of it."""
    if faults.get(request.param):
        missing(f"{request.param}: {faults[request.param]}")
    room = _room(tmp_path, Sandbox(request.param, allow_none=True))
    yield room
    until(lambda: not room.processes())


@pytest.fixture
def best(tmp_path: Path, faults: dict[str, str | None]) -> Iterator[Room]:
    """Lend a room in one sandbox, where the mode makes no difference."""
    mode: SandboxMode = "landlock" if faults["bwrap"] else "bwrap"
    room = _room(tmp_path, Sandbox(mode))
    yield room
    until(lambda: not room.processes())
