"""The room in which an engine renders for an attempt, with the limits of the job and of the worker."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lippmann.job.rendering.render_settings import RenderSettings
from lippmann.job.resolved import ResolvedJob
from worker.engines.engine import Room
from worker.engines.povray import engine as povray
from worker.engines.povray.answers.progress import Phase
from worker.engines.povray.command import RenderCommand
from worker.engines.povray.render import RenderOutcome
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.settings import WorkerSettings
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace

CPU_PER_SECOND = 4.0
"""The least limit of CPU seconds per elapsed second: photons are shot by 4 threads, whatever +WT is."""


@contextmanager
def room_for(
    place: Workplace,
    sheet: ResolvedJob,
    *,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
    threads: int = 1,
    is_probe: bool = False,
) -> Iterator[Room]:
    """Yield the room in which an engine renders a job, given at its frame.

    Parameters
    ----------
    folder
        The folder of the task.
    log
        The log that receives what the engine prints.
    threads
        The number of threads that trace.
    is_probe
        True if the limit of the probe counts too.
    """
    settings = sheet.spec.render

    def progressed(fraction: float) -> None:
        monitor.progress = fraction

    with place.bundle(sheet.bundle) as bundle:
        yield Room(
            folder=folder,
            bundle=bundle,
            sandbox=place.sandbox_for(sheet.bundle),
            program=place.settings.povray,
            limits=process_limits(settings, place.settings, threads=threads),
            times=time_limits(settings, place.settings, is_probe=is_probe),
            log=log,
            keep_bundle=lambda: place.bundle(sheet.bundle),
            keep_folder=place.task_folder,
            on_progress=progressed,
            announce_end=monitor.announce_end,
            should_stop=monitor.should_stop,
        )


def run_povray(
    place: Workplace,
    sheet: ResolvedJob,
    command: RenderCommand,
    *,
    folder: Path,
    log: AttemptLog,
    monitor: ProgressMonitor,
) -> RenderOutcome:
    """Run a command of POV-Ray that is no picture of a frame, such as a report of the scene's camera."""
    with room_for(place, sheet, folder=folder, log=log, monitor=monitor, threads=command.threads) as room:
        return povray.run_povray(room, sheet, command)


def process_limits(job: RenderSettings, worker: WorkerSettings, *, threads: int = 1) -> Limits:
    """Return the limits of a POV-Ray process: those of the job, or lower ones of the worker."""
    timeout_s = min(job.timeout_s, worker.timeout_s)
    return Limits(cpu_s=max(CPU_PER_SECOND, threads) * timeout_s, memory_mb=min(job.memory_mb, worker.memory_mb))


def time_limits(job: RenderSettings, worker: WorkerSettings, *, is_probe: bool) -> TimeLimits:
    """Return the time limits of a picture: those of the job, or lower ones of the worker."""

    def limit(name: str) -> TimeLimit:
        of_job = TimeLimit(getattr(job, name), f"render.{name} of the job")
        return of_job.or_lower(getattr(worker, name, None), f"LIPPMANN_{name.upper()} of the worker")

    total, of_probe = limit("timeout_s"), limit("probe_timeout_s")
    return TimeLimits(
        total=total.or_lower(of_probe.seconds, of_probe.source) if is_probe else total,
        stall=limit("stall_s"),
        phases={Phase.PARSING: limit("parse_timeout_s"), Phase.PHOTONS: limit("photons_timeout_s")},
    )
