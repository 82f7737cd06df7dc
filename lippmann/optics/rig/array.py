"""Where the lenses of an array stand, and the window that a camera must see of it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lippmann.job.rig import LensArray, Rig
from lippmann.lattice.hexagonal_pixels import array_extent, hexagonal_rows, overhang_rows

HEXAGONAL_ROW = math.sqrt(3) / 2
"""Distance of neighbouring lens rows of a hexagonal lattice, in pitches."""

HEXAGON_CORNER = 1 / math.sqrt(3)
"""From the centre of a hexagonal lens to its corners, in pitches."""


def row_pitch_mm(array: LensArray) -> float:
    """Return the distance of neighbouring lens rows."""
    return array.pitch_mm * (HEXAGONAL_ROW if array.lattice == "hexagonal" else 1.0)


def row_shift_mm(array: LensArray, lens_row: NDArray[np.int_]) -> NDArray[np.float64]:
    """Return how far lens rows stand to the right of the middle: -p/4 and +p/4 in turn on a hexagonal lattice."""
    if array.lattice == "square" or array.count[0] == 1:
        return np.zeros(lens_row.shape)
    return np.where(lens_row % 2 == 1, 0.25, -0.25) * array.pitch_mm


def extent_mm(array: LensArray) -> tuple[float, float]:
    """Return the array's (width, height), corner to corner of its outermost lenses."""
    high, wide = array_extent(*array.count, hexagonal=array.lattice == "hexagonal")
    return wide * array.pitch_mm, high * array.pitch_mm


def lens_centres_mm(array: LensArray) -> NDArray[np.float64]:
    """Return the centres in the rig frame, shape (lens_row, lens_col, 2), mm as (x, y).

    Lens row 0 is the top one (greatest y), lens col 0 the left one (least x), as the observer sees them.
    """
    lens_rows, lens_cols = array.count
    row = np.arange(lens_rows)
    x = (np.arange(lens_cols) - (lens_cols - 1) / 2) * array.pitch_mm + row_shift_mm(array, row)[:, np.newaxis]
    y = np.broadcast_to((((lens_rows - 1) / 2 - row) * row_pitch_mm(array))[:, np.newaxis], x.shape)
    return np.stack((x, y), axis=-1)


def nearest_centre_mm(array: LensArray, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the centre of the lens that each point (..., 2) is nearest to, shape (..., 2); see `inside_cell`."""
    row = (array.count[0] - 1) / 2 - points_mm[..., 1] / row_pitch_mm(array)
    if array.lattice == "square":
        return _nearest_in_row(array, points_mm, _lens_row(array, np.round(row)))
    above = _nearest_in_row(array, points_mm, _lens_row(array, np.floor(row)))
    below = _nearest_in_row(array, points_mm, _lens_row(array, np.ceil(row)))
    far = np.linalg.norm(points_mm - above, axis=-1) > np.linalg.norm(points_mm - below, axis=-1)
    return np.where(far[..., np.newaxis], below, above)


def inside_cell(array: LensArray, from_centre_mm: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether points (..., 2), told from the centre of a lens, lie in its cell, border included."""
    x, y = np.abs(from_centre_mm[..., 0]), np.abs(from_centre_mm[..., 1])
    half = array.pitch_mm / 2
    if array.lattice == "square":
        return np.asarray((x <= half) & (y <= half))
    return np.asarray((x <= half) & (x / 2 + y * HEXAGONAL_ROW <= half))


def _lens_row(array: LensArray, row: NDArray[np.float64]) -> NDArray[np.int_]:
    return np.clip(np.nan_to_num(row), 0, array.count[0] - 1).astype(np.int_)


def _nearest_in_row(
    array: LensArray, points_mm: NDArray[np.float64], lens_row: NDArray[np.int_]
) -> NDArray[np.float64]:
    lens_rows, lens_cols = array.count
    shift_mm = row_shift_mm(array, lens_row)
    col = np.round((points_mm[..., 0] - shift_mm) / array.pitch_mm + (lens_cols - 1) / 2)
    x = (np.clip(col, 0, lens_cols - 1) - (lens_cols - 1) / 2) * array.pitch_mm + shift_mm
    y = ((lens_rows - 1) / 2 - lens_row) * row_pitch_mm(array)
    return np.stack((x, y), axis=-1)


def sheet_px(rig: Rig) -> tuple[int, int]:
    """Return (rows, cols) of the integral image: whole pixels under every lens, whole rows over a hexagon's corners."""
    (lens_rows, lens_cols), n = rig.lens_array.count, rig.px_per_lens
    if rig.lens_array.lattice == "square":
        return lens_rows * n, lens_cols * n
    row_px = hexagonal_rows(n)
    return lens_rows * row_px + 2 * overhang_rows(row_px), lens_cols * n + (n // 2 if lens_rows > 1 else 0)


def pixel_mm(rig: Rig) -> tuple[float, float]:
    """Return the (width, height) of a rendered pixel: nearly square on a hexagonal lattice."""
    array, n = rig.lens_array, rig.px_per_lens
    row_px = n if array.lattice == "square" else hexagonal_rows(n)
    return array.pitch_mm / n, row_pitch_mm(array) / row_px


def window_mm(rig: Rig) -> tuple[float, float]:
    """Return the (width, height) that the sheet covers on the MLA plane."""
    (rows, cols), (width, height) = sheet_px(rig), pixel_mm(rig)
    return cols * width, rows * height


def view_width_mm(rig: Rig) -> float:
    """Return the width that a perspective camera's angle spans: the device's window, or the array alone."""
    width_mm, _ = window_mm(rig)
    device = rig.device
    if device is None:
        return width_mm
    if device.window_px is not None:
        return device.window_px[1] * device.pixel_mm
    return width_mm + 2 * device.margin_px * device.pixel_mm
