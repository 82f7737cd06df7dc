"""What a job will take, before anything was measured on it: memory of a slot, CPU time of a frame.

Estimates, from the fish scene at three sizes (57,600 to 5,760,000 px) on one core of a 2-vCPU AMD EPYC cloud machine
that others used too, POV-Ray 3.7; a heavier scene takes longer. What counts in the farm is what its probe measures.
"""

from __future__ import annotations

from dataclasses import dataclass

from worker.job.spec import JobSpec
from worker.optics.method import Method
from worker.plan.sampling import frame_size

MEASURED_ON = "one core of a 2-vCPU AMD EPYC cloud machine, fish scene"

START_S = 1.2
"""POV-Ray's start, and reading the scene with its pictures."""
S_PER_PX = {"raytraced": 1.02e-5, "ray_camera": 1.2e-5}
"""CPU seconds a rendered pixel: glass 59.8 s for 5.76 million; the ray camera's file is parsed anew for every tile."""

RENDER_MB, RENDER_B_PER_PX = 86.0, 19.0
"""Resident memory of POV-Ray: 95 MB for 0.5 million pixels, 194 MB for 5.76 million."""
ASSEMBLE_MB, ASSEMBLE_B_PER_PX = 105.0, 69.0
"""Resident memory of a worker that assembles: 141 MB and 500 MB."""
MASTER_B_PER_PX = 6
"""Three channels of half-floats, before compression."""


@dataclass(frozen=True)
class Estimate:
    """What a job will take."""

    frames: int
    sheet_mb: float
    """One integral image in half-floats."""
    memory_mb: float
    """The most that one slot takes, frames not cut into tiles."""
    frame_cpu_s: float
    """To render one frame."""
    cpu_s: float
    """To render all frames."""


def estimate(spec: JobSpec, method: Method) -> Estimate:
    """Return what a job will take by its number of pixels.

    >>> from worker.job.spec import parse_spec
    >>> round(estimate(parse_spec({"scene": "fish"}), "raytraced").frame_cpu_s, 1)
    6.5
    """
    px = frame_size(spec.rig).px
    rendered_px = px * spec.capture.supersample**2
    frames = len(spec.frame_numbers)
    frame_cpu_s = START_S + rendered_px * S_PER_PX[method]
    memory_mb = max(RENDER_MB + rendered_px * RENDER_B_PER_PX / 1e6, ASSEMBLE_MB + px * ASSEMBLE_B_PER_PX / 1e6)
    return Estimate(
        frames=frames,
        sheet_mb=px * MASTER_B_PER_PX / 1e6,
        memory_mb=memory_mb,
        frame_cpu_s=frame_cpu_s,
        cpu_s=frames * frame_cpu_s,
    )
