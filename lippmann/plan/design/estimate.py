"""Estimates of a job before it is measured: the memory of a slot and the CPU time of a frame.

Estimates, right within 15 % for the fish scene at 57,600 to 5,760,000 px on one core of a 2-vCPU AMD EPYC cloud machine
that others used too, POV-Ray 3.7; a heavier scene takes longer. What counts in the farm is what its probe measures.
"""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.job.spec import JobSpec
from lippmann.optics.rig.method import Method
from lippmann.plan.cost import COMFORTABLE_PX
from lippmann.plan.sampling import frame_size

MEASURED_ON = "one core of a 2-vCPU AMD EPYC cloud machine, fish scene"

START_S = 1.0
"""CPU seconds to start POV-Ray and to read the scene with its pictures."""
S_PER_PX = {"glass": 1.1e-5, "ray_camera": 8.5e-6}
"""CPU seconds per rendered pixel: glass 6.7, 25.8 and 59.8 s for 0.52, 2.07 and 5.76 million; the ray camera 4.7 and
18.4 s for the first two, its trace (1.2e-6) included."""

DEPTH_S_PER_PX = 1.45e-5
"""CPU seconds per pixel of the integral image for `capture.depth`: 8.4 s for 0.52 million, of which 4.0 s are the
worker's own."""

START_MB = {"glass": 86.0, "ray_camera": 190.0}
B_PER_PX = {"glass": 19.0, "ray_camera": 160.0}
"""Resident memory while a tile is rendered: POV-Ray with glass took 95 MB for 0.5 million pixels and 194 MB for 5.76;
rays take about 160 bytes a pixel in POV-Ray, and the worker 118 MB to write 5.76 million of them."""
ASSEMBLE_MB, ASSEMBLE_B_PER_PX = 105.0, 69.0
"""Resident memory of a worker that assembles: 141 MB for 0.5 million pixels, 500 MB for 5.76."""
MASTER_B_PER_PX = 6
"""The bytes of a pixel: three channels of half floats, before compression."""


@dataclass(frozen=True)
class Estimate:
    """The estimated resources of a job."""

    frames: int
    sheet_mb: float
    """The size of one integral image in half floats."""
    memory_mb: float
    """The largest memory of one slot."""
    frame_cpu_s: float
    """CPU time to render one frame."""
    cpu_s: float
    """CPU time to render all frames."""


def estimate(spec: JobSpec, method: Method) -> Estimate:
    """Estimate the resources of a job from its number of pixels.

    >>> from lippmann.job.spec import parse_spec
    >>> round(estimate(parse_spec({"scene": "fish"}), "glass").frame_cpu_s, 1)
    6.7
    """
    px = frame_size(spec.rig).px
    rendered_px = px * spec.rays_per_px
    frames = len(spec.frame_numbers)
    frame_cpu_s = START_S + rendered_px * S_PER_PX[method]
    if spec.capture.depth:
        frame_cpu_s += START_S + px * DEPTH_S_PER_PX
    # Frames that the farm may cut are cut at least this small.
    tile_px = min(rendered_px, COMFORTABLE_PX) if spec.render.tiles == "auto" else rendered_px
    render_mb = START_MB[method] + tile_px * B_PER_PX[method] / 1e6
    if spec.capture.depth:  # The ray camera renders depth, whichever method captures the colours.
        render_mb = max(render_mb, START_MB["ray_camera"] + min(tile_px, px) * B_PER_PX["ray_camera"] / 1e6)
    memory_mb = max(render_mb, ASSEMBLE_MB + px * ASSEMBLE_B_PER_PX / 1e6)
    return Estimate(
        frames=frames,
        sheet_mb=px * MASTER_B_PER_PX / 1e6,
        memory_mb=memory_mb,
        frame_cpu_s=frame_cpu_s,
        cpu_s=frames * frame_cpu_s,
    )
