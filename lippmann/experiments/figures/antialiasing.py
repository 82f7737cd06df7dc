"""Fig. 9: rendering time against the antialiasing threshold, sampling methods 1 and 2, depth 3.

Antialiasing multiplies the rendering time. Therefore only a sixth of the video frame is timed, 15 of its 90 columns of
lenses from top to bottom; each of its pixels is the same as in the whole frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lippmann.experiments import settings
from lippmann.experiments.fits import Line, line_through
from lippmann.experiments.frames import prepared
from lippmann.experiments.request import FigureRequest, FigureResult
from lippmann.experiments.timing import RenderTime, render_time
from lippmann.local.studies.plot import BLUE, GREEN, ORANGE, axes
from lippmann.plan.sampling import Tile, cut_tiles, frame_size

THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
"""POV-Ray 3.7 accepts only thresholds below 1; the paper's 3 means that antialiasing is off."""
QUICK_THRESHOLDS = (0.05, 0.4)
METHODS = (1, 2)
DEPTH = 3
STRIPS, MIDDLE = 6, 2
"""The number of strips of the frame, and the strip that is timed, which shows fish, sky and water."""

Runs = Mapping[int, Sequence[RenderTime]]
"""The runs of each method, in the order of the thresholds."""


def fig9(request: FigureRequest) -> FigureResult:
    """Measure the times, fit their growth, and plot both."""
    thresholds = QUICK_THRESHOLDS if request.quick else THRESHOLDS
    request.report(0.0, "antialiasing off")
    off = _run("off", request)
    runs: dict[int, list[RenderTime]] = {method: [] for method in METHODS}
    for number, (method, threshold) in enumerate((m, t) for m in METHODS for t in thresholds):
        request.report(number / (len(METHODS) * len(thresholds)), f"method {method}, threshold {threshold:g}")
        runs[method].append(_run({"threshold": threshold, "method": method, "depth": DEPTH}, request))
    by_sample = line_through(*_samples_and_times(runs))
    lines = {method: line_through(thresholds, [run.cpu_s for run in runs[method]]) for method in METHODS}
    files = (request.file(".png"), request.file(".svg"))
    _plot(thresholds, off, runs, lines, request, files)
    measured: dict[str, Any] = {
        "part_of_the_frame": f"strip {MIDDLE + 1} of {STRIPS}",
        "off": off.data(),
        **{
            f"method_{method}": [
                {"threshold": t, **run.data()} for t, run in zip(thresholds, runs[method], strict=True)
            ]
            for method in METHODS
        },
        "fit": {"y": "cpu_s", "x": "samples", **by_sample.data()},
        **{
            f"fit_of_method_{method}": {"y": "cpu_s", "x": "threshold", **line.data()} for method, line in lines.items()
        },
    }
    spec = settings.video(frames="1", quick=request.quick, camera=request.camera)
    text = _text(thresholds, off, runs, by_sample, lines)
    return FigureResult(files=files, settings=settings.job_data(spec), measured=measured, text=text)


def _run(antialias: Any, request: FigureRequest) -> RenderTime:
    spec = settings.video(frames="1", quick=request.quick, antialias=antialias, camera=request.camera)
    with prepared(spec, request) as job:
        return render_time(job, tile=_strip(frame_size(spec.rig)))


def _strip(size: Any) -> Tile:
    return cut_tiles(size, tile_rows=1, tile_cols=STRIPS)[MIDDLE]


def _samples_and_times(runs: Runs) -> tuple[list[float], list[float]]:
    # The run without antialiasing is left out: added samples fall on the fish, which costs more than the sky.
    everything = [run for method in METHODS for run in runs[method]]
    return [float(run.samples) for run in everything], [run.cpu_s for run in everything]


def _text(thresholds: Sequence[float], off: RenderTime, runs: Runs, by_sample: Line, lines: Mapping[int, Line]) -> str:
    rows = [
        f"threshold {threshold:4g}  method 1 {runs[1][number].cpu_s:7.2f} s  method 2 {runs[2][number].cpu_s:7.2f} s"
        for number, threshold in enumerate(thresholds)
    ]
    fits = [f"method {method}: {_fit_text(line)}" for method, line in lines.items()]
    samples = (
        f"time = {by_sample.constant:.2f} s + {1e6 * by_sample.slope:.2f} us a sample,"
        f" within {by_sample.largest_deviation:.1%}"
    )
    return "\n".join([*rows, f"off             {off.cpu_s:7.2f} s", samples, *fits])


def _fit_text(line: Line) -> str:
    sign = "+" if line.slope > 0 else "-"
    return f"{line.constant:.1f} s {sign} {abs(line.slope):.1f} s x threshold (within {line.largest_deviation:.0%})"


def _plot(
    thresholds: Sequence[float],
    off: RenderTime,
    runs: Runs,
    lines: Mapping[int, Line],
    request: FigureRequest,
    files: tuple[Path, ...],
) -> None:
    with axes(
        title="Rendering time and antialiasing threshold: depth 3, a sixth of the video frame",
        x="antialiasing threshold",
        y="CPU time, s (one thread)",
        note=str(request.machine),
        files=files,
    ) as drawn:
        names = {1: "method 1, not recursive", 2: "method 2, recursive"}
        for method, (colour, marker) in {1: (BLUE, "o"), 2: (ORANGE, "s")}.items():
            times, line = [run.cpu_s for run in runs[method]], lines[method]
            drawn.plot(thresholds, times, marker, color=colour, markersize=7, label=names[method])
            drawn.plot(thresholds, [line.at(t) for t in thresholds], color=colour, linewidth=1.2, label=_fit_text(line))
        drawn.axhline(off.cpu_s, color=GREEN, linestyle="--", linewidth=1.5, label=f"off: {off.cpu_s:.1f} s")
        drawn.set_ylim(bottom=0)
        drawn.set_xlim(left=0)
