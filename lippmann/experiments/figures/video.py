"""Figs. 10 and 11: two successive frames of an integral video, and their views."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lippmann.experiments import settings
from lippmann.experiments.frames import Light, LocalJob, prepared
from lippmann.experiments.panels import Panel, cut, enlarged, fitted, write_panels
from lippmann.experiments.request import FigureRequest, FigureResult
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.views import centre, view
from lippmann.plan import artifact_names as names
from worker.images.write import write_png

FRAMES = "1-2"
WHOLE_PX = 720
CELLS_SHOWN = 18
"""The lenses across the enlarged part of a frame."""

SIX_PX, SIXTEEN_PX = 360, 135
"""The width of a view among six, and on the contact sheet, px."""


def fig10(request: FigureRequest) -> FigureResult:
    """Make two successive orthoscopic frames of an integral video."""
    spec = settings.video(frames=FRAMES, quick=request.quick, camera=request.camera)
    with prepared(spec, request) as job:
        cpu_s = job.render(request.report)
        first, second = (job.picture(names.orthoscopic_name(frame)) for frame in (1, 2))
    files = [request.file(".png"), request.file("a.png"), request.file("b.png")]
    n, turn = spec.rig.px_per_lens, spec.parameters.get("turn_deg_per_frame", 8)
    write_panels(files[0], [_wholes(first, second), _parts(first, second, n)])
    for file, frame in zip(files[1:], (first, second), strict=True):
        write_png(file, frame)
    changed = _share_changed(first, second)
    measured = {"cols_px": first.shape[1], "rows_px": first.shape[0], "px_that_changed": changed, "cpu_s": cpu_s}
    text = (
        f"two frames of {first.shape[1]} x {first.shape[0]} px, fish turned by {turn} degrees between them;"
        f" {changed:.0%} of the pixels differ; {cpu_s:.1f} s of CPU"
    )
    return FigureResult(files=tuple(files), settings=settings.job_data(spec), measured=measured, text=text)


def fig11(request: FigureRequest) -> FigureResult:
    """Make the 16 views of a row of two frames, six of them large, and the video of all successive views."""
    spec = settings.video(frames=FRAMES, quick=request.quick, camera=request.camera)
    with prepared(spec, request) as job:
        cpu_s = job.render(request.report)
        figure, sheet, video = request.file(".png"), request.file("-16-views.png"), request.file(".mp4")
        views = [_row_of_views(job, frame) for frame in (1, 2)]
        job.video("views.mp4", video)
        n = job.layout.px_per_lens
    six = [0, n // 2, n - 1]
    write_panels(figure, [_six(row, six, start) for row, start in zip(views, (0, 3), strict=True)])
    write_panels(sheet, [_sixteen(row, number) for number, row in enumerate(views, start=1)])
    steps = {
        "to_the_next_view": _mean_step(views[0]),
        "to_the_next_frame": _difference(views[0][n // 2], views[1][n // 2]),
    }
    measured = {
        "views_in_a_row_of_two_frames": 2 * n,
        "views_in_the_movie": 2 * n * n,
        "view_rows_px": views[0][0].shape[0],
        "view_cols_px": views[0][0].shape[1],
        "six_views": [f"frame {frame}, u {u}" for frame in (1, 2) for u in six],
        "mean_difference": steps,
        "cpu_s": cpu_s,
    }
    rows, cols = views[0][0].shape[:2]
    text = (
        f"{2 * n} views of {cols} x {rows} px in a row of two frames, {2 * n * n} in the video;"
        f" from one view to the next they differ by {steps['to_the_next_view']:.3f} of white on average,"
        f" from one frame to the next by {steps['to_the_next_frame']:.3f}"
    )
    return FigureResult(files=(figure, sheet, video), settings=settings.job_data(spec), measured=measured, text=text)


def _wholes(first: Light, second: Light) -> list[Panel]:
    # A frame that is small enough is printed pixel for pixel.
    return [
        Panel(
            enlarged(frame, 1) if frame.shape[1] == WHOLE_PX else fitted(frame, WHOLE_PX),
            f"({letter}) integral video frame {number}, orthoscopic",
        )
        for number, (letter, frame) in enumerate((("a", first), ("b", second)), start=1)
    ]


def _parts(first: Light, second: Light, n: int) -> list[Panel]:
    middle = (first.shape[0] // 2 // n * n, first.shape[1] // 2 // n * n)
    side = min(CELLS_SHOWN * n, *first.shape[:2])
    return [
        Panel(
            enlarged(cut(frame, middle=middle, side_px=side), WHOLE_PX // side), f"The middle of ({letter}), enlarged"
        )
        for letter, frame in (("a", first), ("b", second))
    ]


def _row_of_views(job: LocalJob, frame: int) -> list[NDArray[np.float16]]:
    """Return the views of the middle row of a frame, from the leftmost eye to the rightmost."""
    upright, layout = job.picture(names.orthoscopic_name(frame)), job.layout
    return [view(upright, layout, u, _middle_row(layout)) for u in range(layout.px_per_lens)]


def _middle_row(layout: CellLayout) -> int:
    return centre(layout)[1]


def _six(row: Sequence[Light], chosen: Sequence[int], first_letter: int) -> list[Panel]:
    names_of_views = ("extreme left", "middle", "extreme right")
    frame = first_letter // 3 + 1
    return [
        Panel(fitted(row[u], SIX_PX), f"({'abcdef'[first_letter + number]}) frame {frame}, {names_of_views[number]}")
        for number, u in enumerate(chosen)
    ]


def _sixteen(row: Sequence[Light], frame: int) -> list[Panel]:
    return [Panel(fitted(picture, SIXTEEN_PX), f"frame {frame}, u {u}") for u, picture in enumerate(row)]


def _mean_step(row: Sequence[Light]) -> float:
    return float(np.mean([_difference(left, right) for left, right in pairwise(row)]))


def _difference(one: Light, other: Light) -> float:
    return float(np.abs(_seen(one) - _seen(other)).mean())


def _share_changed(one: Light, other: Light) -> float:
    """Return the fraction of the pixels that differ by more than a hundredth of white."""
    return float((np.abs(_seen(one) - _seen(other)).max(axis=-1) > 0.01).mean())


def _seen(linear: Light) -> NDArray[np.float32]:
    return np.clip(linear.astype(np.float32), 0.0, 1.0)
