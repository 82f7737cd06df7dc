"""Turn a stored picture upright, as its orientation tag says."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def upright(stored: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Return a picture with its top in the first row and its left side in the first column.

    Parameters
    ----------
    stored
        `(rows, cols, channel)`.
    orientation
        The number of TIFF 6.0, tag 274: which sides of the picture the first row and the first column are.

    Returns
    -------
    NDArray
        The picture, contiguous; from 5 on its rows are the columns that were stored.

    Examples
    --------
    >>> stored = np.arange(6).reshape(2, 3, 1)
    >>> upright(stored, 6)[..., 0]
    array([[3, 0],
           [4, 1],
           [5, 2]])
    """
    # First row and first column: 1 top left, 2 top right, 3 bottom right, 4 bottom left, 5 left top, 6 right top,
    # 7 right bottom, 8 left bottom.
    turned = stored.swapaxes(0, 1) if orientation >= 5 else stored
    if orientation in (3, 4, 7, 8):
        turned = turned[::-1]
    if orientation in (2, 3, 6, 7):
        turned = turned[:, ::-1]
    return np.ascontiguousarray(turned)
