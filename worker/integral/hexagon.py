"""A hexagonal lens in pixels."""

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
