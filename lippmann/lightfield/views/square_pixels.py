"""Resample views of a hexagonal lattice to square pixels."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.interpolation import Light, between, neighbours, working

Number = TypeVar("Number", bound=np.generic)


def as_square(view: NDArray[Light], layout: CellLayout) -> NDArray[Light]:
    """Resample a view to square pixels, one pitch wide, around the middle of the array.

    In pitches from the middle, output pixel (i, j) of R x C is at x = j - (C - 1) / 2, y = i - (R - 1) / 2. Lens (r, c)
    stands at x = c - (lens_cols - 1) / 2 - 1/4, or + 1/4 in a shifted row (0 if there is one row only), y = (r -
    (lens_rows - 1) / 2) sqrt(3) / 2. So every lens row is interpolated a quarter of a lens along, to the one side or
    the other, then between rows; linearly, and at the borders by the outermost lens. Turning the array by 180 degrees
    turns the result.

    Parameters
    ----------
    view
        `(lens_rows, lens_cols, channel)`, linear light.
    layout
        Of the sheet that it is a view of.

    Returns
    -------
    NDArray
        `(*layout.square_size(), channel)` in the view's dtype; the view itself when the lattice is square.

    Raises
    ------
    LayoutError
        If there are not as many pixels as lenses.
    """
    _check_view(view, layout)
    if not layout.interlocks:  # the lenses stand on a square grid
        return view
    aligned = working(view)
    if layout.lens_rows > 1:
        for first in range(2):
            quarter = -0.25 if layout.shift_px(first) else 0.25
            aligned[first::2] = _interpolated(
                aligned[first::2], np.arange(layout.lens_cols, dtype=np.float64) + quarter, axis=1
            )
    rows, _ = layout.square_size()
    at = (np.arange(rows, dtype=np.float64) - (rows - 1) / 2) / layout.cell.row_pitch + (layout.lens_rows - 1) / 2
    return _interpolated(aligned, at, axis=0).astype(view.dtype)


def _interpolated(picture: NDArray[Light], at: NDArray[np.float64], *, axis: int) -> NDArray[np.floating[Any]]:
    """Return a picture at other places along an axis, held to the outermost pixels."""
    first, second, weight = neighbours(at, 0, picture.shape[axis] - 1)
    weights = weight.reshape(-1, *[1] * (picture.ndim - 1 - axis))
    return between(picture.take(first, axis), picture.take(second, axis), weights)


def nearest_as_square(view: NDArray[Number], layout: CellLayout) -> NDArray[Number]:
    """Resample a view to square pixels from the nearest lenses, for numbers that must not be mixed.

    Parameters
    ----------
    view
        `(lens_rows, lens_cols, channel)`, any numbers.
    layout
        Of the sheet that it is a view of.

    Raises
    ------
    LayoutError
        If there are not as many pixels as lenses.
    """
    _check_view(view, layout)
    if not layout.interlocks:  # the lenses stand on a square grid
        return view
    rows, cols = layout.square_size()
    at = (np.arange(rows) - (rows - 1) / 2) / layout.cell.row_pitch + (layout.lens_rows - 1) / 2
    lens_row = np.clip(np.rint(at), 0, layout.lens_rows - 1).astype(np.intp)
    further = np.array([layout.shift_px(int(row)) / layout.px_per_lens for row in lens_row])
    middle = 0.25 if layout.lens_rows > 1 else 0.0
    at_col = np.arange(cols) + middle - further[:, np.newaxis]
    lens_col = np.clip(np.rint(at_col), 0, cols - 1).astype(np.intp)
    nearest: NDArray[Number] = view[lens_row[:, np.newaxis], lens_col]
    return nearest


def _check_view(view: NDArray[Any], layout: CellLayout) -> None:
    if view.ndim != 3 or view.shape[:2] != (layout.lens_rows, layout.lens_cols):
        raise LayoutError(f"expected a view of {layout}, got an array of shape {view.shape}")
