"""Where the lenses of an array stand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from worker.job.spec import LensArray


def extent_mm(array: LensArray) -> tuple[float, float]:
    """Return the array's (width, height)."""
    lens_rows, lens_cols = array.count
    return lens_cols * array.pitch_mm, lens_rows * array.pitch_mm


def lens_centres_mm(array: LensArray) -> NDArray[np.float64]:
    """Return the centres in the rig frame, shape (lens_row, lens_col, 2), mm as (x, y).

    Lens row 0 is the top one (greatest y), lens col 0 the left one (least x), as the observer sees them.
    """
    lens_rows, lens_cols = array.count
    x = (np.arange(lens_cols) - (lens_cols - 1) / 2) * array.pitch_mm
    y = ((lens_rows - 1) / 2 - np.arange(lens_rows)) * array.pitch_mm
    return np.stack(np.meshgrid(x, y), axis=-1)
