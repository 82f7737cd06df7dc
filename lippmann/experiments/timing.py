"""The rendering time of one picture on one thread."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from typing import Any

from lippmann.experiments.frames import LocalJob
from lippmann.plan.sampling import Tile, frame_size
from worker.engines.povray.engine import render_picture
from worker.sandbox.log import AttemptLog
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.picture import room_for
from worker.tasks.frames.render import wanted_region

_SAMPLES = re.compile(r"Pixels:\s+(\d+)\s+Samples:\s+(\d+)")


@dataclass(frozen=True)
class RenderTime:
    """The cost of rendering a picture."""

    px: int
    samples: int
    """The camera rays that POV-Ray counted; antialiasing takes more than one for some pixels."""
    cpu_s: float
    """The CPU time of POV-Ray, s."""
    trace_cpu_s: float
    """The CPU time of tracing alone, as POV-Ray reports it, s."""
    wall_s: float

    def data(self) -> dict[str, Any]:
        """Return the cost as data for JSON."""
        return asdict(self)


def render_time(job: LocalJob, *, tile: Tile | None = None, times: int = 1) -> RenderTime:
    """Render the first frame of a job, or a tile of it, on one thread; return the run with the least CPU time.

    Other work on the machine only adds to the time.
    """
    return min((_once(job, tile) for _ in range(times)), key=lambda run: run.cpu_s)


def _once(job: LocalJob, tile: Tile | None) -> RenderTime:
    frame = job.sheet.spec.frame_numbers[0]
    with job.place.task_folder() as folder:
        log_file = folder.with_suffix(".txt")
        try:
            with AttemptLog(log_file) as log:
                there = job.sheet.at(frame)
                with room_for(job.place, there, folder=folder, log=log, monitor=NullMonitor()) as room:
                    picture = render_picture(wanted_region(job.sheet, frame, tile), room)
            samples = read_samples(log_file.read_text(encoding="utf-8", errors="replace"))
        finally:
            log_file.unlink(missing_ok=True)
    outcome, px = picture.outcome, (tile or frame_size(job.sheet.spec.rig)).px
    return RenderTime(
        px=px,
        samples=samples,
        cpu_s=outcome.cpu_s,
        trace_cpu_s=outcome.statistics.trace_cpu_s,
        wall_s=outcome.wall_s,
    )


def read_samples(log: str) -> int:
    """Return the number of camera rays in a log of POV-Ray: one for each pixel, and those that antialiasing adds.

    >>> read_samples("Pixels:            57600   Samples:          518400   Smpls/Pxl: 9.00")
    576000
    """
    found = _SAMPLES.search(log)
    return int(found[1]) + int(found[2]) if found else 0
