"""Fig. 9: rendering time against the antialiasing threshold, sampling methods 1 and 2, depth 3.

At threshold 0.02 a frame takes 12 to 26 times as long as without antialiasing. So a sixth of the video frame is timed,
15 of its 90 columns of lenses from top to bottom: each of its pixels is what it is in the whole frame.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lippmann.experiments import settings
from lippmann.experiments.fits import Line, line_through
from lippmann.experiments.frames import prepared
from lippmann.experiments.request import Made, Request
from lippmann.experiments.timing import Timed, timed
from lippmann.local.plot import BLUE, GREEN, ORANGE, axes
from lippmann.plan.sampling import Tile, cut_tiles, frame_size

THRESHOLDS = (0.02, 0.05, 0.1, 0.2, 0.4, 0.8)
"""POV-Ray 3.7 takes thresholds below 1 only; the paper's 3 is antialiasing switched off."""
QUICK_THRESHOLDS = (0.05, 0.4)
METHODS = (1, 2)
DEPTH = 3
STRIPS, MIDDLE = 6, 2
"""The frame is cut into so many strips side by side, and this one is timed: where the fish is, sky and water too."""

Runs = Mapping[int, Sequence[Timed]]
"""By method, in the order of the thresholds."""


def fig9(request: Request) -> Made:
    """Measure the times, fit their growth, and plot both."""
    thresholds = QUICK_THRESHOLDS if request.quick else THRESHOLDS
    request.tell(0.0, "antialiasing off")
    off = _run("off", request)
    runs: dict[int, list[Timed]] = {method: [] for method in METHODS}
    for number, (method, threshold) in enumerate((m, t) for m in METHODS for t in thresholds):
        request.tell(number / (len(METHODS) * len(thresholds)), f"method {method}, threshold {threshold:g}")
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
    spec = settings.video(frames="1", quick=request.quick)
    text = _text(thresholds, off, runs, by_sample, lines)
    return Made(files=files, settings=settings.shown(spec), measured=measured, text=text)


def _run(antialias: Any, request: Request) -> Timed:
    spec = settings.video(frames="1", quick=request.quick, antialias=antialias)
    with prepared(spec, request) as job:
        return timed(job, tile=_strip(frame_size(spec.rig)))


def _strip(size: Any) -> Tile:
    return cut_tiles(size, tile_rows=1, tile_cols=STRIPS)[MIDDLE]


def _samples_and_times(runs: Runs) -> tuple[list[float], list[float]]:
    # Without the run that is not antialiased: added samples fall on the fish, which costs more than the sky.
    everything = [run for method in METHODS for run in runs[method]]
    return [float(run.samples) for run in everything], [run.cpu_s for run in everything]


def _text(thresholds: Sequence[float], off: Timed, runs: Runs, by_sample: Line, lines: Mapping[int, Line]) -> str:
    rows = [
        f"threshold {threshold:4g}  method 1 {runs[1][number].cpu_s:7.2f} s  method 2 {runs[2][number].cpu_s:7.2f} s"
        for number, threshold in enumerate(thresholds)
    ]
    fits = [f"method {method}: {_words(line)}" for method, line in lines.items()]
    samples = (
        f"time = {by_sample.constant:.2f} s + {1e6 * by_sample.slope:.2f} us a sample,"
        f" within {by_sample.largest_deviation:.1%}"
    )
    return "\n".join([*rows, f"off             {off.cpu_s:7.2f} s", samples, *fits])


def _words(line: Line) -> str:
    sign = "+" if line.slope > 0 else "-"
    return f"{line.constant:.1f} s {sign} {abs(line.slope):.1f} s x threshold (within {line.largest_deviation:.0%})"


def _plot(
    thresholds: Sequence[float],
    off: Timed,
    runs: Runs,
    lines: Mapping[int, Line],
    request: Request,
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
            drawn.plot(thresholds, [line.at(t) for t in thresholds], color=colour, linewidth=1.2, label=_words(line))
        drawn.axhline(off.cpu_s, color=GREEN, linestyle="--", linewidth=1.5, label=f"off: {off.cpu_s:.1f} s")
        drawn.set_ylim(bottom=0)
        drawn.set_xlim(left=0)
