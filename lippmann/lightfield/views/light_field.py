"""All views of a sheet in one array: `(v, u, row, col, channel)`.

v grows as the eye moves down, u as it moves to the right (see `views`). Row and col are those of the lenses, or, of a
hexagonal lattice put on square pixels, of `square_size`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.hexagonal_pixels import ROW_PITCH
from lippmann.lattice.layout import CellLayout, Pixel
from lippmann.lightfield.views.square_pixels import as_square, square_size
from lippmann.lightfield.views.views import views_grid


def light_field(ortho: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return all views, `(cell_rows, cell_cols, lens_rows, lens_cols, channel)`; zero where there is none.

    Parameters
    ----------
    ortho
        Orthoscopic sheet `(rows, cols, channel)`, any dtype.
    layout
        How its pixels lie under the lenses.

    Raises
    ------
    LayoutError
        If the sheet is not of this layout.
    """
    grid = views_grid(ortho, layout)
    views, lenses = (layout.cell_rows, layout.cell_cols), (layout.lens_rows, layout.lens_cols)
    return grid.reshape(views[0], lenses[0], views[1], lenses[1], -1).transpose(0, 2, 1, 3, 4)


def on_square_pixels(views: NDArray[np.floating[Any]], layout: CellLayout) -> NDArray[np.floating[Any]]:
    """Return views `(v, u, lens_row, lens_col, channel)` on square pixels, `(v, u, *square_size(layout), channel)`.

    All at once, by `as_square`; of a square lattice the views themselves.
    """
    if layout.lattice == "square":
        return views
    v, u, lens_rows, lens_cols, channels = views.shape
    stacked = views.transpose(2, 3, 0, 1, 4).reshape(lens_rows, lens_cols, -1)
    rows, cols = square_size(layout)
    return as_square(stacked, layout).reshape(rows, cols, v, u, channels).transpose(2, 3, 0, 1, 4)


def lens_places(layout: CellLayout) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the lenses stand, (right, down) from the array's middle in pitches, both `(lens_row, lens_col)`.

    Examples
    --------
    >>> lens_places(CellLayout(2, 2, 4, "hexagonal"))[0]
    array([[-0.75,  0.25],
           [-0.25,  0.75]])
    """
    row_pitch = 1.0 if layout.lattice == "square" else ROW_PITCH
    shift = np.array([layout.shift_px(row) for row in range(layout.lens_rows)]) / layout.px_per_lens
    right = np.arange(layout.lens_cols) + 0.5 + shift[:, np.newaxis] - layout.cols / layout.px_per_lens / 2
    down = (np.arange(layout.lens_rows) - (layout.lens_rows - 1) / 2) * row_pitch
    return right, np.broadcast_to(down[:, np.newaxis], right.shape).copy()


def square_places(layout: CellLayout) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where the square pixels of a view lie; see `lens_places`."""
    rows, cols = square_size(layout)
    right, down = np.meshgrid(np.arange(cols) - (cols - 1) / 2, np.arange(rows) - (rows - 1) / 2)
    return right, down


def eye_slopes(layout: CellLayout, *, gap_in_pitches: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the slopes at which the views are seen, to the right of each u and downward of each v.

    The tangent of the angle between the eye's direction and the display's axis: (u - middle) P / g, with the pixel P
    and the gap g. Down, pixels of a hexagonal lattice are ROW_PITCH / `row_px` pitches high.

    Parameters
    ----------
    layout
        Of the sheet.
    gap_in_pitches
        g by the pitch of the lenses.
    """
    row_pitch = 1.0 if layout.lattice == "square" else ROW_PITCH
    right = (np.arange(layout.cell_cols) - (layout.cell_cols - 1) / 2) / layout.px_per_lens
    down = (np.arange(layout.cell_rows) - (layout.cell_rows - 1) / 2) * row_pitch / layout.row_px
    return right / gap_in_pitches, down / gap_in_pitches
