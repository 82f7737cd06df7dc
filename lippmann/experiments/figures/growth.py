"""Fig. 8: rendering time against pixels per lens, 100 x 100 lenses, antialiasing off."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lippmann.experiments import settings
from lippmann.experiments.fits import Line, line_through
from lippmann.experiments.frames import prepared
from lippmann.experiments.request import FigureRequest, FigureResult
from lippmann.experiments.timing import RenderTime, render_time
from lippmann.local.studies.plot import BLUE, ORANGE, axes
from lippmann.plan.sampling import frame_size

PX_PER_LENS = (4, 6, 8, 12, 16, 20, 24)
QUICK_PX_PER_LENS = (4, 8, 12)
TIMES = 2
"""The number of times that each picture is rendered; the run with the least CPU time counts."""


def fig8(request: FigureRequest) -> FigureResult:
    """Measure the times, fit a line in the number of pixels, and plot both."""
    chosen = QUICK_PX_PER_LENS if request.quick else PX_PER_LENS
    runs = []
    for number, n in enumerate(chosen):
        request.report(sum(k * k for k in chosen[:number]) / sum(k * k for k in chosen), f"{n} px per lens")
        runs.append(_run(n, request))
    line = line_through([run.px for run in runs], [run.cpu_s for run in runs])
    files = (request.file(".png"), request.file(".svg"))
    _plot(chosen, runs, line, request, files)
    spec = settings.pixels_per_lens(chosen[-1], quick=request.quick, camera=request.camera)
    measured: dict[str, Any] = {
        "runs": [{"px_per_lens": n, **run.data()} for n, run in zip(chosen, runs, strict=True)],
        "best_of": TIMES,
        "fit": {"y": "cpu_s", "x": "px", **line.data()},
    }
    return FigureResult(
        files=files, settings=settings.job_data(spec), measured=measured, text=_text(chosen, runs, line)
    )


def _run(px_per_lens: int, request: FigureRequest) -> RenderTime:
    with prepared(settings.pixels_per_lens(px_per_lens, quick=request.quick, camera=request.camera), request) as job:
        return render_time(job, times=TIMES)


def _text(chosen: Sequence[int], runs: Sequence[RenderTime], line: Line) -> str:
    times = [f"{n:3} px per lens  {run.cpu_s:7.2f} s of CPU" for n, run in zip(chosen, runs, strict=True)]
    fit = (
        f"{line.constant:.2f} s + {1e6 * line.slope:.2f} us a pixel;"
        f" the measured times are within {line.largest_deviation:.1%} of that line"
    )
    return "\n".join([*times, fit])


def _plot(
    chosen: Sequence[int], runs: Sequence[RenderTime], line: Line, request: FigureRequest, files: tuple[Path, ...]
) -> None:
    size = frame_size(settings.pixels_per_lens(chosen[-1], quick=request.quick, camera=request.camera).rig)
    lenses = f"{size.lens_cols} x {size.lens_rows} lenses"
    with axes(
        title=f"Rendering time and pixels per lens: {lenses}, antialiasing off",
        x="pixels across a lens",
        y="rendering time, s (one thread)",
        note=str(request.machine),
        files=files,
    ) as drawn:
        fine = [chosen[0] + (chosen[-1] - chosen[0]) * part / 100 for part in range(101)]
        pixels = size.lens_rows * size.lens_cols
        fitted = [line.at(pixels * n * n) for n in fine]
        label = f"{line.constant:.2f} s + {1e6 * line.slope:.2f} µs a pixel (within {line.largest_deviation:.1%})"
        drawn.plot(fine, fitted, color=BLUE, linewidth=1.5, label=label)
        drawn.plot(chosen, [run.cpu_s for run in runs], "o", color=BLUE, markersize=7, label="CPU time")
        drawn.plot(chosen, [run.wall_s for run in runs], "x", color=ORANGE, markersize=7, label="wall-clock time")
        drawn.set_xticks(chosen)
        drawn.set_ylim(bottom=0)
