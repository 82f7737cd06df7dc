"""Rectify a picture whose pitch is not a whole number of pixels: the inverse of `device`.

The picture is a sheet on a device's pixels, where cells of 23 and 24 px alternate, or a scan, whose lattice may be
rotated. The result has whole cells, from which views, perspectives and refocused pictures are computed. Every cell is
interpolated between its own pixels alone (`light_under`), so no light passes from one cell into another.

Nothing is averaged, so ask for about as many pixels per lens as there are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.cell_sampling import Places, light_under, picture_places
from lippmann.lightfield.sheet.cells import Run, run_px, runs
from lippmann.lightfield.sheet.interpolation import Light
from lippmann.lightfield.sheet.lens_grid import LensGrid

LEAST_PITCH_PX = 2.0
"""The least pitch at which every lens whose centre lies on the picture has a pixel of its own, px."""


def rectify(picture: NDArray[Light], grid: LensGrid, layout: CellLayout | None = None) -> NDArray[Light]:
    """Resample a picture to a sheet of whole cells.

    Parameters
    ----------
    picture
        `(rows, cols, channel)`, linear light. A lens that its edge cuts goes on with its outermost pixels.
    grid
        Where the picture's lenses are.
    layout
        Of the sheet: as many lenses of the same lattice; without it `grid.layout()`.

    Returns
    -------
    NDArray
        `(layout.rows, layout.cols, channel)` in the picture's dtype; zero where there is no lens.

    Raises
    ------
    LayoutError
        If it is no picture, its lenses are smaller than 2 px, a lens's centre lies beyond its edge, or the layout
        has other lenses.
    """
    layout = layout or grid.layout()
    _check(picture, grid, layout)
    sheet = np.zeros((layout.rows, layout.cols, picture.shape[2]), dtype=picture.dtype)
    for run in runs(layout):
        run_px(sheet, layout, run)[:] = light_under(picture, grid, _run_places(grid, layout, run))
    return sheet


def _run_places(grid: LensGrid, layout: CellLayout, run: Run) -> Places:
    """Return where the pixels of a run are under the picture's lenses, `(lens_row, lens_col, px)`."""
    cols = np.arange(run.cell_cols.start, run.cell_cols.stop)
    down = (run.cell_row - (layout.cell_rows - 1) / 2) / layout.row_px * grid.row_px
    return Places(
        np.arange(run.first_lens_row, layout.lens_rows, 2)[:, np.newaxis, np.newaxis],
        np.arange(layout.lens_cols)[:, np.newaxis],
        np.array(down),
        (cols - (layout.cell_cols - 1) / 2) / layout.px_per_lens * grid.pitch_px,
    )


def _check(picture: NDArray[Any], grid: LensGrid, layout: CellLayout) -> None:
    if picture.ndim != 3:
        raise LayoutError(f"expected a picture (rows, cols, channel), got an array of shape {picture.shape}")
    if grid.layout(layout.px_per_lens) != layout:
        raise LayoutError(f"expected a layout of the same lenses as {grid}, got {layout}")
    if min(grid.pitch_px, grid.row_px) < LEAST_PITCH_PX:
        raise LayoutError(f"expected lenses of at least {LEAST_PITCH_PX:g} px both ways, got {grid}")
    high, wide = picture.shape[:2]
    lens_row, lens_col = np.arange(grid.lens_rows)[:, np.newaxis], np.arange(grid.lens_cols)
    at = picture_places(grid, Places(lens_row, lens_col, np.array(0.0), np.array(0.0)))
    beyond = (at[0] < 0) | (at[0] > high) | (at[1] < 0) | (at[1] > wide)
    if beyond.any():
        row, col = np.argwhere(beyond)[0]
        down, right = (float(part[row, col]) for part in at)
        raise LayoutError(
            f"expected every lens's centre on the picture of {high} x {wide} px, got lens ({row}, {col}) at"
            f" ({down:.1f}, {right:.1f}) px for {grid}"
        )
