"""Render one picture: command, sandbox, process and diagnosis together."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lippmann.errors import PovrayMissing, RenderFailed
from worker.engines.povray.command import RenderCommand, povray_argv
from worker.engines.povray.diagnosis import Case, diagnose, is_startup_fault
from worker.engines.povray.environment import ascii_path, prepare
from worker.engines.povray.messages import MessageKind, Statistics, read_messages, read_statistics
from worker.engines.povray.progress import PovrayProgressReader, Progress
from worker.sandbox.limits import Limits, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.process import Outcome, run
from worker.sandbox.sandbox import PATH, Sandbox

STARTS = 4
"""Under load, POV-Ray fails to start about once in 40 times by a fault of its own; it is started up to 4 times."""

_MAGIC = {"png16": b"\x89PNG\r\n\x1a\n", "exr": b"\x76\x2f\x31\x01"}
_KEPT_WARNINGS = 20


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
    warnings: tuple[str, ...]
    """The warnings of POV-Ray."""


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
) -> RenderOutcome:
    """Render one picture into `task_dir`, which has the .pov and is the only writable folder.

    Raises
    ------
    SceneError
        If POV-Ray refuses the scene, with file and line.
    Stopped, RenderTimedOut, ParseTimedOut, PhotonsTimedOut, RenderStalled, OutOfMemory, RenderFailed, DiskFull,
    SandboxMissing, PovrayMissing
        See the table of answers in `diagnosis`.
    """
    task_dir = task_dir.resolve()
    readable = [path.resolve() for path in readable]
    program = _found(command.program)
    # POV-Ray works in the task's folder and sees no links from outside the sandbox.
    libraries = tuple(path.resolve() for path in command.library_paths)
    names = tuple(Path(ascii_path(path, start=task_dir)) for path in libraries)
    env = prepare(task_dir)
    inside = sandbox.wrap(
        povray_argv(replace(command, program=program, library_paths=names)),
        readable=[*readable, *_outside_system(program)],
        writable=task_dir,
        limits=limits,
    )
    picture = task_dir / command.picture
    picture.unlink(missing_ok=True)

    def start() -> Outcome[Progress]:
        log.write(f"$ {' '.join(inside)}")
        return run(
            inside,
            cwd=task_dir,
            env=env,
            times=times,
            reader=PovrayProgressReader(first_block_px=command.first_block_px, total_px=command.traced_px),
            on_progress=on_progress,
            should_stop=should_stop,
            log=log,
        )

    outcome, spent_cpu_s = _start_until_it_starts(start, log)
    roots = (*readable, *libraries, task_dir)
    case = Case(outcome, limits, times, roots, free_bytes=shutil.disk_usage(task_dir).free)
    if error := diagnose(case):
        raise error
    _check_picture(picture, command)
    messages = read_messages(outcome.lines, roots=roots)
    return RenderOutcome(
        picture=picture,
        wall_s=outcome.wall_s,
        cpu_s=spent_cpu_s,
        peak_memory_mb=outcome.peak_memory_mb,
        statistics=read_statistics(outcome.lines) or Statistics(),
        radiosity_seen=outcome.progress.radiosity,
        photons_seen=outcome.progress.photons,
        warnings=tuple(str(message) for message in messages if message.kind is MessageKind.WARNING)[:_KEPT_WARNINGS],
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


def _found(program: str) -> str:
    found = shutil.which(program, path=PATH)
    if found is None:
        raise PovrayMissing(f"POV-Ray is not installed on this worker: no {program!r} in {PATH}.")
    return str(Path(found).absolute())


def _outside_system(program: str) -> list[Path]:
    """Return the program itself if it is outside the folders that the sandbox has."""
    return [] if program.startswith(("/usr/", "/bin/")) else [Path(program)]


def _check_picture(picture: Path, command: RenderCommand) -> None:
    magic = _MAGIC[command.picture_format]
    try:
        with picture.open("rb") as file:
            begin = file.read(len(magic))
    except FileNotFoundError as error:
        raise RenderFailed(f"POV-Ray ended well and left no picture {command.picture}.") from error
    if begin != magic:
        raise RenderFailed(f"POV-Ray ended well and left {command.picture} broken: it begins with {begin!r}.")
