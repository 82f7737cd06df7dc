"""Average a rendering with k x k pixels for one; every pixel of the sheet is the mean of light of its own lens.

An average over a whole picture would mix neighbours' cells along their borders. Square cells divide into whole pixels,
so blocks never cross a border. A hexagon's border runs through pixels: there only the fine pixels count that lie under
the same lens as the pixel's centre.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.interpolation import Light, working


def average_in_cells(
    fine: NDArray[Light], layout: CellLayout, k: int, *, row_start: int = 0, col_start: int = 0
) -> NDArray[Light]:
    """Average a rendering, or a region of it, with k x k pixels for one; see the module.

    Row by row, so memory beside the two pictures stays small.

    Parameters
    ----------
    fine
        `(rows k, cols k, channel)` of the region, linear light.
    layout
        Of the whole sheet.
    k
        Fine pixels for one, in each direction.
    row_start, col_start
        Where the region begins in the sheet, px (not fine px); it may begin and end anywhere.

    Returns
    -------
    NDArray
        `(rows, cols, channel)` in the same dtype, averaged in single precision or its own, if higher; zero where
        there is no lens.

    Raises
    ------
    LayoutError
        If the region does not divide by k or lies outside the sheet.
    """
    rows, cols = _region(fine, layout, k, row_start, col_start)
    averaged = np.empty((rows, cols, fine.shape[2]), dtype=fine.dtype)
    kept: dict[tuple[tuple[int, int], ...], NDArray[np.float32]] = {}
    for row in range(rows):
        block = working(fine[row * k : (row + 1) * k]).reshape(k, cols, k, -1)
        if not layout.interlocks:  # every fine pixel lies under the lens of its pixel
            averaged[row] = block.sum(axis=(0, 2)) / (k * k)
            continue
        lenses = _lens_rows_of(layout, row_start + row)
        if lenses not in kept:
            whole = _own_fine_px(layout, lenses, k)
            kept[lenses] = whole[:, col_start : col_start + cols].astype(np.float32)
        own = kept[lenses]
        counts = np.maximum(own.sum(axis=(0, 2)), 1)
        averaged[row] = np.einsum("acbh,acb->ch", block, own) / counts[:, np.newaxis]
    return averaged


def _region(fine: NDArray[Light], layout: CellLayout, k: int, row_start: int, col_start: int) -> tuple[int, int]:
    if k < 1 or fine.ndim != 3 or fine.shape[0] % k or fine.shape[1] % k:
        raise LayoutError(f"expected a region of {k} x {k} times the pixels of {layout}, got shape {fine.shape}")
    rows, cols = fine.shape[0] // k, fine.shape[1] // k
    if not (0 <= row_start <= layout.rows - rows and 0 <= col_start <= layout.cols - cols):
        raise LayoutError(
            f"expected a region inside {layout.rows} x {layout.cols} px, got {rows} x {cols} px from row {row_start},"
            f" col {col_start}"
        )
    return rows, cols


def _lens_rows_of(layout: CellLayout, row: int) -> tuple[tuple[int, int], ...]:
    """Return the lens rows whose boxes a pixel row crosses, as (row in the cell, shift of the lens row)."""
    m = layout.row_px
    candidates = (lens_row for lens_row in (row // m - 1, row // m) if 0 <= lens_row < layout.lens_rows)
    crossed = ((row - lens_row * m, layout.shift_px(lens_row)) for lens_row in candidates)
    return tuple((cell_row, shift) for cell_row, shift in crossed if cell_row < layout.cell_rows)


def _own_fine_px(layout: CellLayout, lenses: tuple[tuple[int, int], ...], k: int) -> NDArray[np.bool_]:
    """Return which fine pixels of a pixel row lie under the lens of their pixel, `(k, cols, k)`."""
    n = layout.px_per_lens
    fine_mask = layout.finer_mask(k)
    own = np.zeros((k, layout.cols, k), dtype=bool)
    for cell_row, shift in lenses:
        cell = fine_mask[cell_row * k : (cell_row + 1) * k].reshape(k, n, k)
        cell = cell & layout.mask[cell_row][:, np.newaxis]
        own[:, shift : shift + layout.lens_cols * n] |= np.tile(cell, (1, layout.lens_cols, 1))
    return own
