"""One picture on one thread, timed."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from typing import Any

from lippmann.experiments.frames import LocalJob
from lippmann.plan.sampling import Tile, frame_size
from worker.sandbox.log import AttemptLog
from worker.tasks.render import render_region
from worker.tasks.watch import Unwatched

_SAMPLES = re.compile(r"Pixels:\s+(\d+)\s+Samples:\s+(\d+)")


@dataclass(frozen=True)
class Timed:
    """What a picture cost."""

    px: int
    samples: int
    """Rays of the camera, by POV-Ray's own account: a pixel has more than one where antialiasing asks for them."""
    cpu_s: float
    """Of POV-Ray as a whole."""
    trace_cpu_s: float
    """Of the tracing alone, by POV-Ray's own account."""
    wall_s: float

    def data(self) -> dict[str, Any]:
        """Return it for JSON."""
        return asdict(self)


def timed(job: LocalJob, *, tile: Tile | None = None, times: int = 1) -> Timed:
    """Render the job's first frame, or a tile of it, with one thread; of several times, the one that took least CPU.

    What else a machine does only adds to the time.
    """
    return min((_once(job, tile) for _ in range(times)), key=lambda run: run.cpu_s)


def _once(job: LocalJob, tile: Tile | None) -> Timed:
    frame = job.sheet.spec.frame_numbers[0]
    with job.place.task_folder() as folder:
        log_file = folder.with_suffix(".txt")
        try:
            with AttemptLog(log_file) as log:
                picture = render_region(job.place, job.sheet, frame, tile, folder=folder, log=log, watch=Unwatched())
            samples = read_samples(log_file.read_text(encoding="utf-8", errors="replace"))
        finally:
            log_file.unlink(missing_ok=True)
    outcome, px = picture.outcome, (tile or frame_size(job.sheet.spec.rig)).px
    return Timed(
        px=px,
        samples=samples,
        cpu_s=outcome.cpu_s,
        trace_cpu_s=outcome.statistics.trace_cpu_s,
        wall_s=outcome.wall_s,
    )


def read_samples(words: str) -> int:
    """Return how many rays of the camera POV-Ray counted: one a pixel, and those that antialiasing adds.

    >>> read_samples("Pixels:            57600   Samples:          518400   Smpls/Pxl: 9.00")
    576000
    """
    found = _SAMPLES.search(words)
    return int(found[1]) + int(found[2]) if found else 0
