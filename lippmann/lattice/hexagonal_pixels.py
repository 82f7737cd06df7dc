"""A hexagonal lens in pixels.

How whole pixels lie under a hexagonal lens: the same numbers for the optics and for the pixels.

The hexagons stand on a corner. Lens rows are pitch sqrt(3) / 2 apart, so a lens of n pixels across has m = about
n sqrt(3) / 2 pixel rows to the next lens row, and pixels are nearly square.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

ROW_PITCH = math.sqrt(3) / 2
"""From lens row to lens row of the hexagonal lattice, in pitches."""


@lru_cache(maxsize=64)
def hexagon_mask(*, px_per_lens: int, row_px: int, overhang_px: int) -> NDArray[np.bool_]:
    """Return which pixels of the box round a hexagonal lens have their centre under the lens.

    With n px across, m px from lens row to lens row and (x, y) from the lens's centre, in px: 2 m |x| + 3 n |y| < 2 m n
    (the slanted sides; |x| < n / 2, the upright ones, holds in the whole box). In integers, so nothing is rounded.

    Parameters
    ----------
    px_per_lens, row_px, overhang_px
        n, m and the pixel rows of the box above and below those m.

    Returns
    -------
    NDArray
        `(cell_row, cell_col)`, read-only; the same when turned by 180 degrees or mirrored.
    """
    n, m = px_per_lens, row_px
    twice_x = np.abs(2 * np.arange(n) + 1 - n)
    twice_y = np.abs(2 * np.arange(m + 2 * overhang_px) + 1 - (m + 2 * overhang_px))
    mask: NDArray[np.bool_] = 2 * m * twice_x[np.newaxis] + 3 * n * twice_y[:, np.newaxis] < 4 * m * n
    mask.flags.writeable = False
    return mask


def hexagonal_rows(px_per_lens: int) -> int:
    """Return the pixel rows from one lens row to the next, m, for an even number of pixels across a lens, n.

    The integer nearest n sqrt(3) / 2 whose parity differs from that of n / 2. Then no centre of a pixel lies on a
    border between lenses, nor does one when every pixel is divided into k x k: with a / 2 and b / 2 the offsets from
    the lens's centre, such a tie would need m a + 3 (n / 2) b = 2 m n k. There a is odd, and b is odd where k m is
    even, else even: the left side is odd and the right one even.

    >>> [hexagonal_rows(n) for n in (2, 4, 8, 10, 16, 24)]
    [2, 3, 7, 8, 13, 21]
    """
    half = px_per_lens // 2
    below = math.isqrt(3 * half * half)
    return below if (below + half) % 2 else below + 1


def overhang_rows(row_px: int) -> int:
    """Return the pixel rows by which hexagons reach beyond the first and the last lens row: a sixth of m, or more.

    >>> [overhang_rows(m) for m in (2, 7, 12, 13)]
    [1, 2, 2, 3]
    """
    return -(-row_px // 6)


def array_extent(lens_rows: int, lens_cols: int, *, hexagonal: bool) -> tuple[float, float]:
    """Return an array's (height, width) in pitches, from the outermost border or corner to the other.

    >>> array_extent(90, 90, hexagonal=False)
    (90.0, 90.0)
    """
    if not hexagonal:
        return float(lens_rows), float(lens_cols)
    return (lens_rows + 1 / 3) * math.sqrt(3) / 2, lens_cols + (0.5 if lens_rows > 1 else 0.0)
