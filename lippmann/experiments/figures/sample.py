"""Figs. 3 and 4: a sample capture with a square and with a hexagonal array, as captured.

A capture is upside down, because the imaging lens inverts it, and pseudoscopic.
"""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.experiments import settings
from lippmann.experiments.frames import Light, prepared
from lippmann.experiments.panels import Panel, cut, enlarged, fitted, write_panels
from lippmann.experiments.request import FigureRequest, FigureResult
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import frame_size
from worker.images.write import write_png

WHOLE_PX = 720
CELLS_SHOWN = 10
"""The lenses across the enlarged part."""


def fig3(request: FigureRequest) -> FigureResult:
    """Make the sample with the square array."""
    return _sample(request, "square")


def fig4(request: FigureRequest) -> FigureResult:
    """Make the sample with the hexagonal array."""
    return _sample(request, "hexagonal")


def _sample(request: FigureRequest, lattice: Literal["square", "hexagonal"]) -> FigureResult:
    spec = settings.still(lattice=lattice, quick=request.quick, camera=request.camera)
    with prepared(spec, request) as job:
        cpu_s = job.render(request.report)
        captured = job.picture(names.integral_name(1))
    layout, n = frame_size(spec.rig), spec.rig.px_per_lens
    whole, part = request.file("-integral.png"), cut(captured, middle=_busiest(captured, n), side_px=CELLS_SHOWN * n)
    write_png(whole, captured)
    figure = request.file(".png")
    size = f"{layout.lens_cols} x {layout.lens_rows} {lattice} lenses, {layout.cols} x {layout.rows} px"
    panels = [
        Panel(fitted(captured, WHOLE_PX), f"The integral image as captured: {size}"),
        Panel(enlarged(part, max(1, WHOLE_PX // part.shape[1])), f"Enlarged: {CELLS_SHOWN} lenses across, {n} px each"),
    ]
    write_panels(figure, [panels])
    measured: dict[str, Any] = {
        "lens_rows": layout.lens_rows,
        "lens_cols": layout.lens_cols,
        "rows_px": layout.rows,
        "cols_px": layout.cols,
        "px_per_lens": n,
        "px_per_lens_row": layout.row_px,
        "cpu_s": cpu_s,
    }
    text = f"{size}; {n} px across a lens, {layout.row_px} from one lens row to the next; {cpu_s:.1f} s of CPU"
    return FigureResult(files=(figure, whole), settings=settings.job_data(spec), measured=measured, text=text)


def _busiest(captured: Light, px_per_lens: int) -> tuple[int, int]:
    """Return the centre of the part with the most contrast, (row, col) px."""
    side = CELLS_SHOWN * px_per_lens
    grey: NDArray[np.float32] = captured.astype(np.float32).mean(axis=-1)
    step = max(1, side // 4)
    places = [
        (row, col)
        for row in range(0, grey.shape[0] - side + 1, step)
        for col in range(0, grey.shape[1] - side + 1, step)
    ]
    row, col = max(places, key=lambda at: float(grey[at[0] : at[0] + side, at[1] : at[1] + side].std()))
    # The part begins on the edge of a cell, so that it shows whole cells.
    row, col = (at // px_per_lens * px_per_lens for at in (row, col))
    return row + side // 2, col + side // 2
