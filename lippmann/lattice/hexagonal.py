"""The hexagonal lattice: hexagons that stand on a corner, every second lens row shifted by half a pitch.

Lens rows are pitch sqrt(3) / 2 apart, so a lens of n pixels across has m = about n sqrt(3) / 2 pixel rows to the next
lens row, and pixels are nearly square.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.arrays import NUMPY, Arrays
from lippmann.lattice.cell import ON_THE_BORDER, Cell, Lattice, Nearest, Ties, nearest_number

if TYPE_CHECKING:
    from lippmann.lattice.lenses import LensLattice


class HexagonalCell(Cell):
    """A regular hexagon that stands on a corner."""

    kind: ClassVar[Lattice] = "hexagonal"
    row_pitch = math.sqrt(3) / 2
    row_shift = 0.5
    row_period = 2
    corners = ((0.0, 2 / 3), (0.5, 1 / 3), (0.5, -1 / 3))
    corner_radius = 1 / math.sqrt(3)
    overhang = 1 / 3
    plural = "hexagonal lenses"

    def border_distance(self, right: Any, down: Any, xp: Arrays = NUMPY) -> Any:
        """Return max(2 |x|, |x| + 3 |y| / 2), y in row pitches: see `Cell.border_distance`."""
        x, y = abs(right), abs(down)
        return xp.maximum(2 * x, x + 1.5 * y)

    def owns(self, right: NDArray[np.float64], down: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which places belong to the cell; see `Cell.owns`."""
        upright = (right >= -0.5 - ON_THE_BORDER) & (right < 0.5 - ON_THE_BORDER)
        slanted = np.abs(right) + 1.5 * np.abs(down) <= 1 + np.where(down > 0, ON_THE_BORDER, -ON_THE_BORDER)
        return np.asarray(upright & slanted)

    def nearest(self, lenses: LensLattice, right: Any, down: Any, *, ties: Ties, xp: Arrays = NUMPY) -> Nearest:
        """Return the nearer of the nearest lenses of the lens rows above and below; see `Cell.nearest`."""
        above = self._row_above(down, lenses.lens_rows, xp)
        upper, lower = (self._nearest_in_row(lenses, above + step, right, down, ties, xp) for step in (0, 1))
        border = 0.0 if ties == "even" else ON_THE_BORDER
        from_upper, from_lower = (xp.sqrt(one.right * one.right + one.down * one.down) for one in (upper, lower))
        take_lower = from_lower < from_upper - border
        return Nearest(
            xp.where(take_lower, lower.lens_row, upper.lens_row),
            xp.where(take_lower, lower.lens_col, upper.lens_col),
            right=xp.where(take_lower, lower.right, upper.right),
            down=xp.where(take_lower, lower.down, upper.down),
        )

    def _nearest_in_row(
        self, lenses: LensLattice, lens_row: Any, right: Any, down: Any, ties: Ties, xp: Arrays
    ) -> Nearest:
        middles = [lenses.row_middle_pitches(number) for number in (0, 1)]
        middle = xp.where((lens_row & 1) == 1, middles[1], middles[0])
        from_first = right - middle + (lenses.lens_cols - 1) / 2
        lens_col = nearest_number(from_first, ties, xp)
        to_row = down - (xp.real(lens_row) - (lenses.lens_rows - 1) / 2) * self.row_pitch
        return Nearest(lens_row, lens_col, right=from_first - xp.real(lens_col), down=to_row)

    def rows_near(self, down: NDArray[np.float64], lens_rows: int) -> tuple[int, int]:
        """Return the lens rows above the uppermost and below the lowest place; see `Cell.rows_near`."""
        above = self._row_above(down, lens_rows)
        return int(above.min()), int(above.max()) + 1

    def _row_above(self, down: Any, lens_rows: int, xp: Arrays = NUMPY) -> Any:
        """Return the lens row whose centres are above, or at, each place."""
        return xp.whole(xp.floor(down / self.row_pitch + (lens_rows - 1) / 2))

    def row_px(self, px_per_lens: int) -> int:
        """Return the pixel rows from one lens row to the next, m, for an even number of pixels across a lens, n.

        This is the integer nearest n sqrt(3) / 2 whose parity differs from that of n / 2. Then no centre of a pixel
        lies on a border between lenses, nor does one when every pixel is divided into k x k: with a / 2 and b / 2 the
        offsets from the lens's centre, such a tie would need m a + 3 (n / 2) b = 2 m n k. There a is odd, and b is odd
        where k m is even, else even: the left side is odd and the right one even.

        >>> [HexagonalCell().row_px(n) for n in (2, 4, 8, 10, 16, 24)]
        [2, 3, 7, 8, 13, 21]
        """
        half = px_per_lens // 2
        below = math.isqrt(3 * half * half)
        return below if (below + half) % 2 else below + 1

    def overhang_px(self, row_px: int) -> int:
        """Return the pixel rows by which hexagons reach beyond the first and the last lens row: a sixth of m, or more.

        >>> [HexagonalCell().overhang_px(m) for m in (2, 7, 12, 13)]
        [1, 2, 2, 3]
        """
        return -(-row_px // 6)

    def mask(self, *, px_per_lens: int, row_px: int, overhang_px: int) -> NDArray[np.bool_]:
        """Return which pixels have their centre in the hexagon; see `Cell.mask`.

        With n px across, m px from lens row to lens row and (x, y) from the lens's centre, in px: 2 m |x| + 3 n |y| <
        2 m n (the slanted sides; |x| < n / 2, the upright ones, holds in the whole box). The sum is made of integers,
        so nothing is rounded.
        """
        return _hexagon_mask(px_per_lens, row_px, overhang_px)


@lru_cache(maxsize=64)
def _hexagon_mask(px_per_lens: int, row_px: int, overhang_px: int) -> NDArray[np.bool_]:
    n, m = px_per_lens, row_px
    twice_x = np.abs(2 * np.arange(n) + 1 - n)
    twice_y = np.abs(2 * np.arange(m + 2 * overhang_px) + 1 - (m + 2 * overhang_px))
    mask: NDArray[np.bool_] = 2 * m * twice_x[np.newaxis] + 3 * n * twice_y[:, np.newaxis] < 4 * m * n
    mask.flags.writeable = False
    return mask
