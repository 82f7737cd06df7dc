"""The scale of small views on a screen, and even sizes."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Code = TypeVar("Code", bound=np.generic)

SCREEN_PX = 720
"""The approximate longer side of a video of views: a view has one pixel per lens, which is small on a screen."""


def screen_scale(rows: int, cols: int) -> int:
    """Return the whole factor that brings the longer side nearest to 720 px; 1 for what is larger.

    Examples
    --------
    >>> screen_scale(90, 90), screen_scale(100, 100), screen_scale(1200, 30)
    (8, 7, 1)
    """
    return max(1, round(SCREEN_PX / max(rows, cols)))


def at_least(frame: NDArray[Code], *, rows: int, cols: int) -> NDArray[Code]:
    """Return a frame with at least so many rows and cols: the last row and the last col are shown again and again.

    Parameters
    ----------
    frame
        `(rows, cols, 3)`, any dtype.
    rows, cols
        The least size, px.

    Returns
    -------
    NDArray
        `(rows, cols, 3)` in the frame's dtype; the frame itself if it is large enough.
    """
    more_rows, more_cols = max(0, rows - frame.shape[0]), max(0, cols - frame.shape[1])
    return np.pad(frame, ((0, more_rows), (0, more_cols), (0, 0)), mode="edge") if more_rows or more_cols else frame


def even_sided(frame: NDArray[Code], *, down: bool = True, across: bool = True) -> NDArray[Code]:
    """Return a frame with an even number of rows (`down`) and cols (`across`), as 4:2:0 needs them.

    An odd last row or col is shown twice.
    """
    odd_rows, odd_cols = frame.shape[0] % 2 * down, frame.shape[1] % 2 * across
    if not odd_rows and not odd_cols:
        return frame
    return np.pad(frame, ((0, odd_rows), (0, odd_cols), (0, 0)), mode="edge")
