"""Resample an integral image to the pixel grid of the device that shows it, never across the edge of a cell.

d = `px_per_lens_device` is the device's pixels in one pitch, any number: 600 dpi and 1 mm make 23.622, so cells of 23
and 24 px alternate. The array stands in the middle of the window: the centre of device pixel i of N lies
(i + 1/2 - N / 2) / d pitches from the middle, to the right or below. A device pixel belongs to the lens that its centre
lies under, on a border to the one to the right or below (see `LensLattice.nearest`); under none there is no
light. Its value is interpolated linearly between the rendered pixels about its centre that are of the same cell; nearer
to the border than the centres of the outermost ones, these go on.

Nothing is averaged, so render about as many pixels per lens as the device has.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.cell import ON_THE_BORDER
from lippmann.lattice.layout import CellLayout, check_sheet
from lippmann.lightfield.sheet.bands import HeldRows, Sheet, SheetOfRows
from lippmann.lightfield.sheet.interpolation import Light, between, neighbours, working

ROWS_AT_ONCE = 64
"""Device rows that are taken from one part of the sheet."""

PX_AT_ONCE = 200_000
"""Device pixels that are worked on together, so that memory beside the two sheets stays at some ten MB."""


def device_size(
    layout: CellLayout, *, px_per_lens_device: float, window: tuple[int, int] | None = None, margin_px: int = 0
) -> tuple[int, int]:
    """Return the size (rows, cols) of an integral image on the device, px.

    Parameters
    ----------
    layout
        Of the sheet as rendered.
    px_per_lens_device
        Pitch by the device's pixel, d.
    window
        (rows, cols) of what is shown or printed. Without it: the whole number of pixels nearest to the array's size,
        and `margin_px` more on each side.
    margin_px
        Counts only without a window.

    Raises
    ------
    LayoutError
        If d is not a positive number, the margin is negative, or the array does not fit in the window.

    Examples
    --------
    >>> device_size(CellLayout(100, 100, 24), px_per_lens_device=600 / 25.4, margin_px=19)
    (2400, 2400)
    """
    if not (math.isfinite(px_per_lens_device) and px_per_lens_device > 0 and margin_px >= 0):
        raise LayoutError(
            f"expected a positive number of device px per lens and no negative margin, got {px_per_lens_device} and"
            f" {margin_px}"
        )
    rows, cols = (max(1, math.floor(side * px_per_lens_device + 0.5)) for side in layout.lenses.extent)
    if window is None:
        return rows + 2 * margin_px, cols + 2 * margin_px
    if window[0] < rows or window[1] < cols:
        raise LayoutError(
            f"expected a window of at least {rows} x {cols} px for {layout} at {px_per_lens_device:g} device px each,"
            f" got {window[0]} x {window[1]}"
        )
    return window


def to_device(
    sheet: NDArray[Light],
    layout: CellLayout,
    *,
    px_per_lens_device: float,
    window: tuple[int, int] | None = None,
    margin_px: int = 0,
) -> NDArray[Light]:
    """Resample an integral image to the pixel grid of a device; see the module.

    Parameters
    ----------
    sheet
        `(rows, cols, channel)` of this layout, linear light.
    layout, px_per_lens_device, window, margin_px
        As in `device_size`.

    Returns
    -------
    NDArray
        `(*device_size, channel)` in the sheet's dtype, interpolated in single precision or the sheet's, if higher.

    Raises
    ------
    LayoutError
        As in `device_size`, or if the sheet is not of this layout.
    """
    check_sheet(sheet, layout)
    rows, cols = device_size(layout, px_per_lens_device=px_per_lens_device, window=window, margin_px=margin_px)
    shown = np.empty((rows, cols, sheet.shape[2]), dtype=sheet.dtype)
    whole = SheetOfRows(HeldRows(sheet), layout)
    made = device_bands(whole, px_per_lens_device=px_per_lens_device, window=window, margin_px=margin_px)
    for start, band in zip(range(0, rows, ROWS_AT_ONCE), made, strict=True):
        shown[start : start + ROWS_AT_ONCE] = band
    return shown


def device_bands(
    sheet: Sheet, *, px_per_lens_device: float, window: tuple[int, int] | None = None, margin_px: int = 0
) -> Iterator[NDArray[Any]]:
    """Yield the rows of an integral image on the pixel grid of a device, top down, `ROWS_AT_ONCE` of them at a time.

    Parameters
    ----------
    sheet
        The orthoscopic sheet; no more of it is held than what lies under a band.
    px_per_lens_device, window, margin_px
        As in `to_device`.

    Yields
    ------
    NDArray
        `(rows, cols, channel)`.
    """
    layout = sheet.layout
    rows, cols = device_size(layout, px_per_lens_device=px_per_lens_device, window=window, margin_px=margin_px)
    down, right = (_offsets(side) / px_per_lens_device for side in (rows, cols))
    # Rows and columns of square cells are interpolated one after the other, which is faster than both at once.
    at = _hexagons_at if layout.interlocks else _squares_at
    step = max(1, PX_AT_ONCE // cols)
    for start in range(0, rows, ROWS_AT_ONCE):
        band = down[start : start + ROWS_AT_ONCE]
        first, stop = layout.lenses.lens_rows_near(band)
        part = sheet.part(first, stop)
        shown = np.empty((len(band), cols, part.shape[2]), dtype=part.dtype)
        for row in range(0, len(band), step):
            place = slice(row, row + step)
            shown[place] = at(part, layout, down=band[place], right=right, first_row=first * layout.row_px)
        yield shown


def _offsets(px: int) -> NDArray[np.float64]:
    """Return the pixels' centres from the middle of a line of them, px."""
    return np.arange(px, dtype=np.float64) + 0.5 - px / 2


@dataclass(frozen=True)
class _Axis:
    """The pixels of the sheet from which those of the device are interpolated, along one axis."""

    first: NDArray[np.intp]
    second: NDArray[np.intp]
    weight: NDArray[np.float64]
    """The weight of the second pixel."""
    lit: NDArray[np.bool_]
    """True where the device pixel lies under a lens."""


def _axis(offset_pitches: NDArray[np.float64], lenses: int, px_per_lens: int) -> _Axis:
    at = offset_pitches + lenses / 2
    lens = _lens_at(at)
    lit = (lens >= 0) & (lens < lenses)
    lens = np.clip(lens, 0, lenses - 1)
    first, second, weight = neighbours((at - lens) * px_per_lens - 0.5, 0, px_per_lens - 1)
    return _Axis(lens * px_per_lens + first, lens * px_per_lens + second, weight, lit)


def _lens_at(at_pitches: NDArray[np.float64]) -> NDArray[np.intp]:
    return np.floor(at_pitches + ON_THE_BORDER).astype(np.intp)


def _squares_at(
    part: NDArray[Light],
    layout: CellLayout,
    *,
    down: NDArray[np.float64],
    right: NDArray[np.float64],
    first_row: int,
) -> NDArray[np.floating[Any]]:
    """Return the light of a square sheet at the places of a grid.

    Parameters
    ----------
    part
        `(rows, cols, channel)`: of a sheet of this layout, the pixel rows from `first_row` on that lie under the
        places' lenses.
    down, right
        Of the grid's rows and cols, from the middle of the array, in pitches.
    first_row
        Of the part, in the sheet.

    Returns
    -------
    NDArray
        `(row, col, channel)`; zero where there is no lens.
    """
    along = _axis(down, layout.lens_rows, layout.px_per_lens)
    across = _axis(right, layout.lens_cols, layout.px_per_lens)
    first, second = (working(part[rows - first_row]) for rows in (along.first, along.second))
    rows = between(first, second, along.weight[:, np.newaxis, np.newaxis])
    pixels = between(rows[:, across.first], rows[:, across.second], across.weight[:, np.newaxis])
    pixels[~along.lit] = 0
    pixels[:, ~across.lit] = 0
    return pixels


def _hexagons_at(
    part: NDArray[Light],
    layout: CellLayout,
    *,
    down: NDArray[np.float64],
    right: NDArray[np.float64],
    first_row: int,
) -> NDArray[np.floating[Any]]:
    """Return the light of a hexagonal sheet at the places of a grid; see `_squares_at` for the parameters.

    A place belongs to the lens whose centre is nearest: of two in a row the right one, of two in two rows the upper.
    Its value is interpolated linearly along the two pixel rows of the cell about it, and between these. A row holds it
    to the pixels that lie in the mask, and only rows that have any count.

    Returns
    -------
    NDArray
        `(row, col, channel)`; zero where there is no lens.
    """
    lenses = layout.lenses
    places = lenses.nearest(right[np.newaxis], down[:, np.newaxis])
    lit = lenses.has(places.lens_row, places.lens_col)
    n, m = layout.px_per_lens, layout.row_px
    has_px = np.flatnonzero(layout.mask.any(axis=1))
    row_in_cell = places.down / layout.cell.row_pitch * m + (layout.cell_rows - 1) / 2
    upper, lower, weight = neighbours(row_in_cell, has_px[0], has_px[-1])
    lens_row = np.clip(places.lens_row, 0, layout.lens_rows - 1)
    top = lens_row * m - first_row
    shifts_px = np.array([layout.shift_px(0), layout.shift_px(1)])
    left = np.clip(places.lens_col, 0, layout.lens_cols - 1) * n + shifts_px[lens_row % 2]
    col_in_cell = places.right * n + (n - 1) / 2
    low, high = _ends(layout.mask)

    def in_row(cell_row: NDArray[np.intp]) -> NDArray[np.floating[Any]]:
        first, second, along = neighbours(col_in_cell, low[cell_row], high[cell_row])
        row = top + cell_row
        return between(working(part[row, left + first]), working(part[row, left + second]), along[:, :, np.newaxis])

    pixels = between(in_row(upper), in_row(lower), weight[:, :, np.newaxis])
    pixels[~lit] = 0
    return pixels


def _ends(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the first and the last pixel of every row of a mask."""
    return mask.argmax(axis=1), mask.shape[1] - 1 - mask[:, ::-1].argmax(axis=1)
