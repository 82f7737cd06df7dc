"""Hexagonal cells at any places: the part of `device` that is the lattice's own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.hexagonal_pixels import ROW_PITCH
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.interpolation import ON_THE_BORDER, Light, between, neighbours, working


@dataclass(frozen=True)
class Nearest:
    """Which lens places are nearest to, in the array or not, and where from its centre: arrays `(row, col)`."""

    lens_row: NDArray[np.intp]
    lens_col: NDArray[np.intp]
    right: NDArray[np.float64]
    """From the lens's centre, pitches."""
    down: NDArray[np.float64]

    def in_array(self, layout: CellLayout) -> NDArray[np.bool_]:
        """Return which of the lenses there are."""
        return _inside(self.lens_row, layout.lens_rows) & _inside(self.lens_col, layout.lens_cols)


def hexagonal_lens_rows_under(layout: CellLayout, down: NDArray[np.float64]) -> tuple[int, int]:
    """Return [first, stop) of the lens rows that rows of places may take their light from; see `hexagons_at`."""
    above = _row_above(layout, down)
    first, last = (int(np.clip(row, 0, layout.lens_rows - 1)) for row in (above.min(), above.max() + 1))
    return first, last + 1


def hexagons_at(
    part: NDArray[Light],
    layout: CellLayout,
    *,
    down: NDArray[np.float64],
    right: NDArray[np.float64],
    first_row: int,
) -> NDArray[np.floating[Any]]:
    """Return the light of a hexagonal sheet at the places of a grid.

    A place belongs to the lens whose centre is nearest: of two in a row the right one, of two in two rows the upper.
    Its value is interpolated linearly along the two pixel rows of the cell about it, and between these. A row holds it
    to the pixels that lie in the mask, and only rows that have any count.

    Parameters
    ----------
    part
        `(rows, cols, channel)`: of a sheet of this layout, the pixel rows from `first_row` on that lie under the
        places' lenses.
    down, right
        Of the grid's rows and cols, from the middle of the array, in pitches.
    first_row
        Of the part, in the sheet.

    Returns
    -------
    NDArray
        `(row, col, channel)`; zero where there is no lens.
    """
    places = nearest_lenses(layout, down[:, np.newaxis], right[np.newaxis])
    lit = places.in_array(layout)
    n, m = layout.px_per_lens, layout.row_px
    has_px = np.flatnonzero(layout.mask.any(axis=1))
    row_in_cell = places.down / ROW_PITCH * m + (layout.cell_rows - 1) / 2
    upper, lower, weight = neighbours(row_in_cell, has_px[0], has_px[-1])
    lens_row = np.clip(places.lens_row, 0, layout.lens_rows - 1)
    top = lens_row * m - first_row
    left = np.clip(places.lens_col, 0, layout.lens_cols - 1) * n + _shifts_px(layout)[lens_row % 2]
    col_in_cell = places.right * n + (n - 1) / 2
    low, high = _ends(layout.mask)

    def in_row(cell_row: NDArray[np.intp]) -> NDArray[np.floating[Any]]:
        first, second, along = neighbours(col_in_cell, low[cell_row], high[cell_row])
        row = top + cell_row
        return between(working(part[row, left + first]), working(part[row, left + second]), along[:, :, np.newaxis])

    pixels = between(in_row(upper), in_row(lower), weight[:, :, np.newaxis])
    pixels[~lit] = 0
    return pixels


def nearest_lenses(layout: CellLayout, down: NDArray[np.float64], right: NDArray[np.float64]) -> Nearest:
    """Return the nearest lens of the lattice, which goes on beyond the array; arguments as in `hexagons_at`."""
    above = _row_above(layout, down)
    upper, lower = (_nearest_in_row(layout, above + step, down, right) for step in (0, 1))
    take_lower = np.hypot(lower.right, lower.down) < np.hypot(upper.right, upper.down) - ON_THE_BORDER
    return Nearest(
        np.where(take_lower, lower.lens_row, upper.lens_row),
        np.where(take_lower, lower.lens_col, upper.lens_col),
        np.where(take_lower, lower.right, upper.right),
        np.where(take_lower, lower.down, upper.down),
    )


def _row_above(layout: CellLayout, down: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the lens row whose centres are above, or at, each place."""
    return np.floor(down / ROW_PITCH + (layout.lens_rows - 1) / 2).astype(np.intp)


def _nearest_in_row(
    layout: CellLayout, lens_row: NDArray[np.intp], down: NDArray[np.float64], right: NDArray[np.float64]
) -> Nearest:
    from_first = right - _row_centres(layout)[lens_row % 2] + (layout.lens_cols - 1) / 2
    lens_col = np.floor(from_first + 0.5 + ON_THE_BORDER).astype(np.intp)
    to_row = down - (lens_row - (layout.lens_rows - 1) / 2) * ROW_PITCH
    wide_row, wide_down, _ = np.broadcast_arrays(lens_row, to_row, from_first)
    return Nearest(wide_row, lens_col, from_first - lens_col, wide_down)


def _row_centres(layout: CellLayout) -> NDArray[np.float64]:
    """Return the middle of an even and of an odd lens row, right of the array's, in pitches."""
    if layout.lens_rows == 1:
        return np.array([0.0, 0.5])
    return _shifts_px(layout) / layout.px_per_lens - 0.25


def _shifts_px(layout: CellLayout) -> NDArray[np.intp]:
    return np.array([layout.shift_px(0), layout.shift_px(1)])


def _ends(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first and the last pixel of every row of a mask."""
    return mask.argmax(axis=1), mask.shape[1] - 1 - mask[:, ::-1].argmax(axis=1)


def _inside(number: NDArray[np.intp], count: int) -> NDArray[np.bool_]:
    return (number >= 0) & (number < count)
