"""A room for sessions with a stand-in for the program, in each sandbox of this machine."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from lippmann.job.rendering.render_settings import Channel
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import SceneManifest
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import parse_spec
from tests.needs import missing
from tests.waiting import until
from worker.engines.mitsuba.inside.messages import Request
from worker.engines.mitsuba.render import RenderedRegion, render
from worker.engines.mitsuba.session import Session, SessionKey, Slot
from worker.sandbox.detect import trial
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.sandbox import Sandbox, SandboxMode

STAND_IN = Path(__file__).with_name("stand_in.py")
KEY = SessionKey("anna", "job", "digest", Limits(cpu_s=60, memory_mb=400, disk_mb=16, file_mb=8), "llvm_ad_rgb")


@dataclass
class Room:
    """A slot with its sandbox, a bundle with the stand-in, and the folders that were lent."""

    root: Path
    sandbox: Sandbox
    job: ResolvedJob
    program: str
    slot: Slot = field(default_factory=Slot)
    number: int = 0

    @property
    def bundle(self) -> Path:
        """The folder of the bundle."""
        return self.root / "bundle"

    def ask(
        self,
        behaviour: str = "render",
        *,
        key: SessionKey = KEY,
        channels: tuple[Channel, ...] = (),
        stall_s: float = 120,
        total_s: float = 240,
        should_stop: Callable[[], bool] = lambda: False,
        on_progress: Callable[[float], None] = lambda progress: None,
    ) -> RenderedRegion:
        """Render two pixels as the stand-in behaves."""
        (self.bundle / "behaviour").write_text(behaviour)
        self.number += 1
        request = Request(
            number=self.number,
            job=self.job,
            frame=1,
            rows=4,
            cols=4,
            region=(0, 1, 1, 3),
            channels=channels,
            next_job=self.job if "motion" in channels else None,
            bundle=str(self.bundle),
            out=str(self.number),
        )
        times = TimeLimits(total=TimeLimit(total_s, "total"), stall=TimeLimit(stall_s, "stall"))
        with AttemptLog(self.root / "log.txt") as log, self.session(key) as session:
            return render(session, request, times=times, on_progress=on_progress, should_stop=should_stop, log=log)

    def session(self, key: SessionKey = KEY) -> AbstractContextManager[Session]:
        """Lend the session of the slot."""
        program = (str(self.bundle / self.program),)
        return self.slot.session(key, bundle=self._bundle, folder=self.folder, sandbox=self.sandbox, program=program)

    @contextmanager
    def _bundle(self) -> Iterator[Path]:
        yield self.bundle

    @contextmanager
    def folder(self) -> Iterator[Path]:
        """Lend a folder for a session."""
        with tempfile.TemporaryDirectory(dir=self.root, prefix="session-") as name:
            Path(name).chmod(0o711)
            yield Path(name)

    def processes(self) -> list[Path]:
        """Return the processes that work in folders of sessions."""
        return [process for process in Path("/proc").glob("[0-9]*") if self._is_below(process)]

    def _is_below(self, process: Path) -> bool:
        try:
            return (process / "cwd").readlink().is_relative_to(self.root)
        except OSError:
            return False


@pytest.fixture(scope="module", params=["bwrap", "landlock"])
def sandbox(request: pytest.FixtureRequest) -> Sandbox:
    """Return each sandbox of this machine."""
    mode: SandboxMode = request.param
    found = Sandbox(mode)
    if fault := trial(found):
        missing(f"{mode}: {fault}")
    return found


@pytest.fixture
def room(sandbox: Sandbox, tmp_path: Path) -> Iterator[Room]:
    """Lend a room with the stand-in; afterwards no process and no folder of a session is left."""
    with make_room(tmp_path, sandbox, STAND_IN) as made:
        yield made


@contextmanager
def make_room(root: Path, sandbox: Sandbox, program: Path) -> Iterator[Room]:
    """Lend a room with a program; afterwards no process and no folder of a session is left."""
    for folder in (root, *root.parents[:2]):
        folder.chmod(0o755)
    (root / "bundle").mkdir()
    shutil.copy(program, root / "bundle")
    stage = Stage(location=(0, 0, -10), look_at=(0, 0, 0), near_mm=900, far_mm=1100)
    manifest = SceneManifest(title="A", stage=stage).model_copy(update={"file": "scene.xml"})
    job = ResolvedJob.of("job", parse_spec({"scene": "mine"}), manifest, bundle="digest").at(1)
    made = Room(root, sandbox, job, program.name)
    yield made
    made.slot.end()
    until(lambda: not made.processes())
    assert sorted(path.name for path in root.iterdir() if path.is_dir()) == ["bundle"]
