"""Cut the sheet into cells, and put cells together to a sheet.

Square cells are the sheet's own memory with other axes. Hexagonal ones interlock, so they are gathered and scattered by
*runs*: one row of pixels of the cells of every other lens row, which is a view of the sheet's memory again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout, Pixel, check_sheet

CACHED_PX = 60_000
"""Pixels that are copied at a time, of 6 bytes in a master: these and their copies fit in a cache of 1 MB."""


@dataclass(frozen=True)
class Run:
    """One pixel row of the cells of the lens rows first_lens_row, first_lens_row + 2, ..: inside the hexagon."""

    first_lens_row: int
    cell_row: int
    cell_cols: slice


def runs(layout: CellLayout) -> Iterator[Run]:
    """Yield the runs of a hexagonal layout: together they are every pixel under a lens, once."""
    for first in range(min(2, layout.lens_rows)):
        for cell_row, inside in enumerate(layout.mask):
            (cols,) = np.nonzero(inside)
            if cols.size:
                yield Run(first, cell_row, slice(int(cols[0]), int(cols[-1]) + 1))


def run_px(sheet: NDArray[Pixel], layout: CellLayout, run: Run) -> NDArray[Pixel]:
    """Return the pixels of a run, a view of the sheet's memory.

    Parameters
    ----------
    sheet
        `(rows, cols, channel)`, any dtype.
    layout
        The lenses over the sheet.
    run
        Which pixels of which lens rows.

    Returns
    -------
    NDArray
        `(lens_row, lens_col, px, channel)`.
    """
    m, n = layout.row_px, layout.px_per_lens
    left = layout.shift_px(run.first_lens_row)
    start = run.first_lens_row * m + run.cell_row
    rows = sheet[start : start + (layout.lens_rows - run.first_lens_row - 1) * m + 1 : 2 * m]
    across = rows[:, left : left + layout.lens_cols * n]
    return across.reshape(len(rows), layout.lens_cols, n, sheet.shape[2])[:, :, run.cell_cols]


def put_pixels(target: NDArray[Pixel], source: NDArray[Pixel]) -> None:
    """Copy pixels between arrays of different memory order.

    Channels are copied one after the other, because an inner loop over three numbers is slow, and so many pixels at a
    time that the part which is read once for every channel stays in the cache of the processor.

    Parameters
    ----------
    target, source
        `(.., channel)`, of one shape.
    """
    step = max(1, CACHED_PX // max(1, math.prod(target.shape[1:-1])))
    for start in range(0, len(target), step):
        part, of_source = target[start : start + step], source[start : start + step]
        for channel in range(target.shape[-1]):
            part[..., channel] = of_source[..., channel]


def cells(sheet: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return the elemental images of a sheet.

    Parameters
    ----------
    sheet
        `(rows, cols, channel)`, any dtype, any strides.
    layout
        How its pixels lie under the lenses.

    Returns
    -------
    NDArray
        `(lens_row, lens_col, cell_row, cell_col, channel)`. Square: a view of the sheet's memory, so writing to it
        writes to the sheet. Hexagonal: a copy, zero outside the mask.

    Raises
    ------
    LayoutError
        If the sheet is not exactly as large as the layout says.

    Examples
    --------
    >>> sheet = np.arange(16).reshape(4, 4, 1)
    >>> cells(sheet, CellLayout(lens_rows=2, lens_cols=2, px_per_lens=2))[0, 1, :, :, 0]
    array([[2, 3],
           [6, 7]])
    """
    check_sheet(sheet, layout)
    lenses, n = (layout.lens_rows, layout.lens_cols), layout.px_per_lens
    if not layout.interlocks:  # cells are rectangles of the sheet, and splitting an axis needs no copy
        return sheet.reshape(lenses[0], n, lenses[1], n, sheet.shape[2]).transpose(0, 2, 1, 3, 4)
    gathered = np.zeros((*lenses, *layout.mask.shape, sheet.shape[2]), dtype=sheet.dtype)
    for run in runs(layout):
        gathered[run.first_lens_row :: 2, :, run.cell_row, run.cell_cols] = run_px(sheet, layout, run)
    return gathered


def sheet_of(cells: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return the sheet that cells make; the inverse of `cells` where there are lenses, zero elsewhere.

    Parameters
    ----------
    cells
        `(lens_row, lens_col, cell_row, cell_col, channel)`; hexagonal: what lies outside the mask is left out.
    layout
        How the sheet's pixels lie under the lenses.

    Returns
    -------
    NDArray
        `(rows, cols, channel)`; square: shares memory where the strides allow it.

    Raises
    ------
    LayoutError
        If these are not the cells of this layout.
    """
    lenses = (layout.lens_rows, layout.lens_cols)
    if cells.ndim != 5 or cells.shape[:4] != (*lenses, layout.cell_rows, layout.cell_cols):
        raise LayoutError(f"expected cells of {layout}, got an array of shape {cells.shape}")
    channels = cells.shape[4]
    if not layout.interlocks:  # the cells are the sheet's memory with other axes
        return cells.transpose(0, 2, 1, 3, 4).reshape(layout.rows, layout.cols, channels)
    sheet = np.zeros((layout.rows, layout.cols, channels), dtype=cells.dtype)
    for run in runs(layout):
        run_px(sheet, layout, run)[:] = cells[run.first_lens_row :: 2, :, run.cell_row, run.cell_cols]
    return sheet
