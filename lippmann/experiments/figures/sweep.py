"""Fig. 7: the array at four positions in the image space, in one job of four frames, and what is real or virtual.

Depth is measured in the views and compared with the exact trace. s is the distance of an image from the array of the
capture, as in the captions of the paper. A display whose array stands one focal length in front of its pixels shows
everything one focal length nearer to the observer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import RenderFailed
from lippmann.experiments import settings
from lippmann.experiments.figures.captions import CAPTIONS, Caption, Depth, agreement, mean_mm
from lippmann.experiments.figures.depth import Patch, depth_mm, lenses_a_view, movement
from lippmann.experiments.frames import Light, LocalJob, prepared
from lippmann.experiments.landmarks import LANDMARKS, Landmark, Traced, rig_place_mm, traced
from lippmann.experiments.panels import Panel, cut, enlarged, fitted, write_panels
from lippmann.experiments.request import FigureRequest, FigureResult
from lippmann.lightfield.observer.stereo import together
from lippmann.lightfield.quality.luminance import luminance
from lippmann.lightfield.views.views import centre, view
from lippmann.optics.lens.matrices import conjugate
from lippmann.optics.rig.bench import Bench, bench
from lippmann.plan import artifact_names as names
from worker.images.write import write_png

QUICK_PX_PER_LENS = 6
CELL_PX = 384
"""The width of a panel, px."""
CELLS_SHOWN = 8
EYE = (0.45, 0.28)
"""The position of the eye of the fish as fractions of height and width: the part that is enlarged."""
TRIED_MM = (-90.0, 90.0)
"""The range of depths in which the depth of a patch is searched, mm."""
TRIED_STEP_MM = 0.5


def fig7(request: FigureRequest) -> FigureResult:
    """Capture the four positions, make panels of them, and measure the depths of fish and stems."""
    spec = settings.sweep(px_per_lens=QUICK_PX_PER_LENS if request.quick else None, camera=request.camera)
    with prepared(spec, request) as job:
        cpu_s = job.render(request.report)
        depths = [measured_depths(job, frame) for frame in spec.frame_numbers]
        figure, *pictures = (request.file(f"{ending}.png") for ending in ("", "a", "b", "c", "d"))
        rows = []
        for frame, caption, found, picture in zip(spec.frame_numbers, CAPTIONS, depths, pictures, strict=True):
            printed = _printed(job, frame)
            write_png(picture, printed)
            rows.append(_panels(job, frame, caption, found, printed))
        write_panels(figure, rows)
    measured = {"positions": list(map(_position, CAPTIONS, settings.POSITIONS_MM, depths)), "cpu_s": cpu_s}
    text = "\n".join(map(_line, CAPTIONS, settings.POSITIONS_MM, depths))
    return FigureResult(files=(figure, *pictures), settings=settings.job_data(spec), measured=measured, text=text)


def measured_depths(job: LocalJob, frame: int) -> tuple[Depth, ...]:
    """Return the depths of the fish and the stems in a frame: paraxial, by the exact trace, and as measured.

    Raises
    ------
    RenderFailed
        If one of them is outside the picture.
    """
    upright, layout = job.picture(names.orthoscopic_name(frame)), job.layout
    row = [view(upright, layout, u, centre(layout)[1]) for u in range(layout.px_per_lens)]
    views = np.stack([luminance(np.clip(picture.astype(np.float64), 0.0, 1.0)) for picture in row])
    return tuple(_depth(job, frame, views, landmark) for landmark in LANDMARKS)


def _depth(job: LocalJob, frame: int, views: NDArray[np.float64], landmark: Landmark) -> Depth:
    there = job.sheet.at(frame)
    array, n = there.spec.rig.lens_array, there.spec.rig.px_per_lens
    optical_bench = bench(there.spec.rig, reference_mm=there.stage.reference_mm)
    place_mm = rig_place_mm(landmark.place, there.stage)
    exact = traced(optical_bench, place_mm)
    to_depth_mm = partial(depth_mm, px_per_lens=n, focal_length_mm=array.focal_length_mm)
    to_lenses = partial(lenses_a_view, px_per_lens=n, focal_length_mm=array.focal_length_mm)
    tried = np.array([to_lenses(float(s_mm)) for s_mm in np.arange(*TRIED_MM, TRIED_STEP_MM)])
    moved = movement(views, _patch(optical_bench, landmark, exact, float(place_mm[2])), tried)
    if moved is None:
        raise RenderFailed(f"expected {landmark.name} in the picture of frame {frame}, got nothing to measure")
    return Depth(
        name=landmark.name,
        by_small_angles_mm=optical_bench.s_mm(-float(place_mm[2])),
        by_exact_trace_mm=to_depth_mm(exact.lenses_a_view),
        measured_mm=to_depth_mm(moved.lenses_a_view),
        likeness=moved.likeness,
    )


def _patch(optical_bench: Bench, landmark: Landmark, exact: Traced, z_mm: float) -> Patch:
    """Return the part of the central view that shows the landmark."""
    assert optical_bench.imaging_lens is not None  # noqa: S101 - the paper's job has one
    lenses_a_mm = (
        abs(conjugate(optical_bench.imaging_lens, -z_mm).magnification) / optical_bench.rig.lens_array.pitch_mm
    )
    return Patch(
        lens_row=float(exact.lens_row.mean()),
        lens_col=float(exact.lens_col.mean()),
        half_rows=max(1, round(landmark.half_height_mm * lenses_a_mm)),
        half_cols=max(1, round(landmark.half_width_mm * lenses_a_mm)),
    )


def _printed(job: LocalJob, frame: int) -> Light:
    """Return the picture to print: on the pixels of the device if the job has one."""
    has_device = job.sheet.spec.rig.device is not None
    return job.picture(names.device_name(frame) if has_device else names.orthoscopic_name(frame))


def _panels(job: LocalJob, frame: int, caption: Caption, depths: Sequence[Depth], printed: Light) -> list[Panel]:
    upright, layout = job.picture(names.orthoscopic_name(frame)), job.layout
    u, v = centre(layout)
    quarter = layout.px_per_lens // 4
    left, right = (view(upright, layout, eye, v) for eye in (quarter, layout.px_per_lens - 1 - quarter))
    side = CELLS_SHOWN * layout.px_per_lens
    part = cut(printed, middle=(int(EYE[0] * printed.shape[0]), int(EYE[1] * printed.shape[1])), side_px=side)
    fish, *stems = (depth.measured_mm for depth in depths)
    offset_mm = settings.POSITIONS_MM[frame - 1]
    side_of = "toward the imaging lens" if offset_mm > 0 else "toward the camera"
    return [
        Panel(fitted(printed, CELL_PX), f"({caption.letter}) array {abs(offset_mm)} mm {side_of}\nthe integral image"),
        Panel(enlarged(part, max(1, CELL_PX // side)), f"part of it, {CELLS_SHOWN} lenses across"),
        Panel(
            fitted(view(upright, layout, u, v), CELL_PX),
            f"the middle view; fish {fish:+.0f} mm,\nstems {', '.join(f'{stem:+.0f}' for stem in stems)} mm",
        ),
        Panel(fitted(together(left, right, "anaglyph"), CELL_PX), "two views for red-cyan glasses\n(red: left eye)"),
    ]


def _position(caption: Caption, offset_mm: float, depths: Sequence[Depth]) -> Mapping[str, Any]:
    return {
        "letter": caption.letter,
        "offset_mm": offset_mm,
        "the_paper_says": caption.text,
        "agrees": agreement(caption, depths),
        "mean_of_the_stems_mm": mean_mm(depths[1:]),
        "depths": [{**asdict(depth), "is": "real" if depth.is_real else "virtual"} for depth in depths],
    }


def _line(caption: Caption, offset_mm: float, depths: Sequence[Depth]) -> str:
    found = "  ".join(f"{depth.name} {depth.measured_mm:+6.1f} ({depth.by_exact_trace_mm:+6.1f})" for depth in depths)
    agrees = f"agrees with the paper: {agreement(caption, depths)}"
    where = f"({caption.letter}) array at {offset_mm:+} mm: s measured (exact trace), mm"
    return f"{where}: {found}  {agrees} ({caption.text})"
