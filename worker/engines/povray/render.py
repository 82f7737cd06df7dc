"""Render one picture: command, sandbox, process and diagnosis together."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lippmann.errors import PovrayMissing, RenderFailed
from worker.engines.povray.answers.diagnosis import Case, diagnose, is_startup_fault
from worker.engines.povray.answers.messages import Statistics, read_statistics
from worker.engines.povray.answers.places import ScenePlaces
from worker.engines.povray.answers.progress import PovrayProgressReader, Progress
from worker.engines.povray.command import RenderCommand, povray_argv
from worker.engines.povray.environment import ascii_path, prepare
from worker.engines.povray.pictures.picture import check_picture, max_picture_bytes
from worker.engines.povray.scenes.scene_files import SceneFiles
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.process import Outcome, run
from worker.sandbox.results import fresh_folder, take_result
from worker.sandbox.sandbox import PATH, Sandbox

STARTS = 4
"""Under load, POV-Ray fails to start about once in 40 times by a fault of its own; it is started up to 4 times."""

WORK_FOLDER = "work"
"""The folder in the folder of a task that POV-Ray can write."""


@dataclass(frozen=True)
class RenderOutcome:
    """A picture and the resources that it took."""

    picture: Path
    wall_s: float
    """The time from the start of the sandbox to its end, of the start that succeeded."""
    cpu_s: float
    """CPU time of the whole sandbox as the kernel counts it, including failed starts."""
    peak_memory_mb: float
    statistics: Statistics
    radiosity_seen: bool
    photons_seen: bool


def render(
    command: RenderCommand,
    *,
    task_dir: Path,
    readable: Sequence[Path],
    sandbox: Sandbox,
    limits: Limits,
    times: TimeLimits,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
    log: AttemptLog,
    scene: SceneFiles | None = None,
) -> RenderOutcome:
    """Render one picture into `task_dir`, which has the .pov.

    POV-Ray can read `task_dir` and write only a folder in it, from which nothing but the picture is taken. Messages
    name places in the files of `scene`, which the .pov includes.

    Raises
    ------
    SceneError
        If POV-Ray refuses the scene, with file and line.
    Stopped, RenderTimedOut, ParseTimedOut, PhotonsTimedOut, RenderStalled, RenderCrashed, OutOfMemory, RenderFailed,
    DiskFull, SandboxMissing, PovrayMissing
        See the table of answers in `diagnosis`.
    """
    task_dir = task_dir.resolve()
    readable = [path.resolve() for path in readable]
    with fresh_folder(task_dir / WORK_FOLDER) as work_dir:
        return _render(
            command,
            task_dir=task_dir,
            work_dir=work_dir,
            readable=readable,
            sandbox=sandbox,
            limits=limits,
            times=times,
            on_progress=on_progress,
            should_stop=should_stop,
            log=log,
            scene=scene,
        )


def _render(
    command: RenderCommand,
    *,
    task_dir: Path,
    work_dir: Path,
    readable: Sequence[Path],
    sandbox: Sandbox,
    limits: Limits,
    times: TimeLimits,
    on_progress: Callable[[Progress], None],
    should_stop: Callable[[], bool],
    log: AttemptLog,
    scene: SceneFiles | None,
) -> RenderOutcome:
    program = _found(command.program)
    # POV-Ray sees no links from outside the sandbox. The folder of the task, which has the .pov, comes first.
    libraries = (task_dir, *(path.resolve() for path in command.library_paths))
    names = tuple(Path(ascii_path(path, start=work_dir)) for path in libraries)
    env = prepare(task_dir, work_dir)
    inside = sandbox.wrap(
        povray_argv(replace(command, program=program, library_paths=names)),
        readable=[*readable, task_dir, *_outside_system(program)],
        writable=work_dir,
        limits=limits,
    )
    (task_dir / command.picture).unlink(missing_ok=True)

    def start() -> Outcome[Progress]:
        log.write(f"$ {' '.join(inside)}")
        return run(
            inside,
            cwd=work_dir,
            env=env,
            times=times,
            reader=PovrayProgressReader(first_block_px=command.first_block_px, total_px=command.traced_px),
            on_progress=on_progress,
            should_stop=should_stop,
            log=log,
            limits=limits,
            groups=sandbox.groups,
        )

    outcome, spent_cpu_s = _start_until_it_starts(start, log)
    case = Case(
        outcome,
        limits,
        times,
        # A file of a bundle is named from the top of the bundle, which is readable, even if its folder is searched.
        roots=tuple(path for path in (*readable, *libraries, task_dir) if not _is_below(path, readable)),
        free_bytes=shutil.disk_usage(task_dir).free,
        places=ScenePlaces(task_dir / command.pov_file, scene) if scene else None,
    )
    if error := diagnose(case):
        raise error
    picture = take_result(work_dir, command.picture, into=task_dir, max_bytes=max_picture_bytes(command))
    if picture is None:
        raise RenderFailed(f"POV-Ray ended well and left no picture {command.picture}.")
    check_picture(picture, command)
    statistics = read_statistics(outcome.lines) or Statistics()
    return RenderOutcome(
        picture=picture,
        wall_s=outcome.wall_s,
        cpu_s=spent_cpu_s,
        peak_memory_mb=outcome.peak_memory_mb,
        statistics=statistics.at_most(wall_s=outcome.wall_s, cpu_s=outcome.cpu_s),
        radiosity_seen=outcome.progress.radiosity,
        photons_seen=outcome.progress.photons,
    )


def _start_until_it_starts(start: Callable[[], Outcome[Progress]], log: AttemptLog) -> tuple[Outcome[Progress], float]:
    cpu_s = 0.0
    for number in range(1, STARTS + 1):
        outcome = start()
        cpu_s += outcome.cpu_s
        if not is_startup_fault(outcome):
            break
        log.write(f"POV-Ray did not start ({number} of {STARTS}); this is a fault of its own.")
    return outcome, cpu_s


def _is_below(path: Path, folders: Sequence[Path]) -> bool:
    return any(folder in path.parents for folder in folders)


def _found(program: str) -> str:
    found = shutil.which(program, path=PATH)
    if found is None:
        raise PovrayMissing(f"POV-Ray is not installed on this worker: no {program!r} in {PATH}.")
    return str(Path(found).absolute())


def _outside_system(program: str) -> list[Path]:
    """Return the program itself if it is outside the folders that the sandbox has."""
    return [] if program.startswith(("/usr/", "/bin/")) else [Path(program)]
