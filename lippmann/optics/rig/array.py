"""The lenses of a rig's array in the rig frame, and the window that a camera must see of it.

The rig frame has x to the right and **y upward**; `lippmann.lattice` counts downward.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.optics.rig import LensArray, Rig
from lippmann.lattice.arrays import NUMPY, Arrays


def extent_mm(array: LensArray) -> tuple[float, float]:
    """Return the array's (width, height) in mm, corner to corner of its outermost lenses."""
    height_mm, width_mm = array.lenses_mm.extent
    return width_mm, height_mm


def lens_centres_mm(array: LensArray) -> NDArray[np.float64]:
    """Return the centres in the rig frame, shape (lens_row, lens_col, 2), mm as (x, y).

    Lens row 0 is the top one (greatest y), lens col 0 the left one (least x), as the observer sees them.
    """
    right, down = array.lenses_mm.centres()
    return np.stack((right, -down), axis=-1)


def nearest_centre_mm(array: LensArray, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the centre of the lens of the array that each point is nearest to; see `inside_cell`.

    Parameters
    ----------
    array
        The array.
    points_mm
        The points in the rig frame, float64 (..., 2), mm as (x, y). A point that is NaN gets the centre of some lens.

    Returns
    -------
    NDArray
        float64 (..., 2), mm as (x, y). For a point beyond the array it is the centre of one of the outermost lenses.
    """
    return np.stack(np.broadcast_arrays(*nearest_centre(array, points_mm[..., 0], points_mm[..., 1])), axis=-1)


def nearest_centre(array: LensArray, x_mm: Any, y_mm: Any, *, xp: Arrays = NUMPY) -> tuple[Any, Any]:
    """Return the centres of the nearest lenses by components, on any library of arrays; see `nearest_centre_mm`.

    Parameters
    ----------
    array
        The array.
    x_mm, y_mm
        The points in the rig frame, arrays of 64-bit numbers of one shape, mm.
    xp
        The library of the arrays.
    """
    lenses = array.lenses_mm
    right, down = (xp.where(at == at, at, 0.0) for at in (x_mm, -y_mm))  # NaN is no number of a lens
    found = lenses.nearest(right, down, ties="even", xp=xp)
    lens_row = xp.minimum(xp.maximum(found.lens_row, 0), lenses.lens_rows - 1)
    lens_col = xp.minimum(xp.maximum(found.lens_col, 0), lenses.lens_cols - 1)
    right, down = lenses.centre_of(lens_row, lens_col, xp=xp)
    return right, -down


def inside_cell(array: LensArray, from_centre_mm: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which points lie in the cell of a lens, its border included.

    Parameters
    ----------
    array
        The array.
    from_centre_mm
        The points from the centre of the lens, float64 (..., 2), mm as (x, y).

    Returns
    -------
    NDArray
        bool (...); False for a point that is NaN.
    """
    inside: NDArray[np.bool_] = array.lenses_mm.contains(from_centre_mm[..., 0], from_centre_mm[..., 1])
    return inside


def pixel_mm(rig: Rig) -> tuple[float, float]:
    """Return the (width, height) of a rendered pixel in mm: nearly square on a hexagonal lattice."""
    height_mm, width_mm = rig.layout.pixel_mm(rig.lens_array.pitch_mm)
    return width_mm, height_mm


def window_mm(rig: Rig) -> tuple[float, float]:
    """Return the (width, height) in mm that the sheet covers on the MLA plane."""
    width_mm, height_mm = pixel_mm(rig)
    return rig.layout.cols * width_mm, rig.layout.rows * height_mm


def view_width_mm(rig: Rig) -> float:
    """Return the width in mm that a perspective camera's angle spans: the device's window, or the array alone."""
    width_mm, _ = window_mm(rig)
    device = rig.device
    if device is None:
        return width_mm
    if device.window_px is not None:
        return device.window_px[1] * device.pixel_mm
    return width_mm + 2 * device.margin_px * device.pixel_mm
