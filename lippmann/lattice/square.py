"""The square lattice: cells are squares side by side."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.arrays import NUMPY, Arrays
from lippmann.lattice.cell import ON_THE_BORDER, Cell, Lattice, Nearest, Ties, nearest_number

if TYPE_CHECKING:
    from lippmann.lattice.lenses import LensLattice


class SquareCell(Cell):
    """A square that stands on a side."""

    kind: ClassVar[Lattice] = "square"
    row_pitch = 1.0
    row_shift = 0.0
    row_period = 1
    corners = ((0.5, 0.5), (0.5, -0.5))
    corner_radius = 1 / math.sqrt(2)
    overhang = 0.0
    plural = "lenses"

    def border_distance(self, right: Any, down: Any, xp: Arrays = NUMPY) -> Any:
        """Return 2 max(|x|, |y|); see `Cell.border_distance`."""
        return 2 * xp.maximum(abs(right), abs(down))

    def owns(self, right: NDArray[np.float64], down: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which places belong to the cell; see `Cell.owns`."""
        low, high = -0.5 - ON_THE_BORDER, 0.5 - ON_THE_BORDER
        return np.asarray((right >= low) & (right < high) & (down >= low) & (down < high))

    def nearest(self, lenses: LensLattice, right: Any, down: Any, *, ties: Ties, xp: Arrays = NUMPY) -> Nearest:
        """Return the nearest lenses, rows and columns each on their own; see `Cell.nearest`."""
        lens_row, past_row = _nearest_on_line(down, lenses.lens_rows, ties, xp)
        lens_col, past_col = _nearest_on_line(right, lenses.lens_cols, ties, xp)
        return Nearest(lens_row, lens_col, right=past_col, down=past_row)

    def rows_near(self, down: NDArray[np.float64], lens_rows: int) -> tuple[int, int]:
        """Return the lens rows that the uppermost and the lowest place are nearest to; see `Cell.rows_near`."""
        lens_row, _ = _nearest_on_line(down, lens_rows, "right")
        return int(lens_row.min()), int(lens_row.max())

    def row_px(self, px_per_lens: int) -> int:
        """Return as many pixel rows as there are pixels across."""
        return px_per_lens

    def overhang_px(self, row_px: int) -> int:
        """Return 0: squares do not reach into the next lens row."""
        return 0

    def mask(self, *, px_per_lens: int, row_px: int, overhang_px: int) -> NDArray[np.bool_]:
        """Return an array of True: a square fills its box; see `Cell.mask`."""
        return np.broadcast_to(np.True_, (row_px + 2 * overhang_px, px_per_lens))


def _nearest_on_line(at: Any, count: int, ties: Ties, xp: Arrays = NUMPY) -> tuple[Any, Any]:
    """Return the numbers of the nearest of evenly spaced lenses, and how far past their centres the places are."""
    lens = nearest_number(at + (count - 1) / 2, ties, xp)
    return lens, at - (xp.real(lens) - (count - 1) / 2)
