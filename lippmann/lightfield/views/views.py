"""Sub-aperture views of an orthoscopic integral image, one pixel per lens, and the inverse.

Views are numbered `(u, v)` from `(0, 0)`: **u grows as the eye moves to the right, v as it moves down**, as the
observer of the display sees it. An eye at x_eye sees, under the lens at x_k, the pixel at
u_k = -(g/P) (x_eye - x_k) / L from the lens's axis (g the reduced gap, P the pixel, L the distance): the further right
the eye, the further *left* the pixel, and likewise the further down, the further up. So in a cell of `cell_rows` x
`cell_cols` px

    row in cell = cell_rows - 1 - v,   col in cell = cell_cols - 1 - u.

On the hexagonal lattice only the views exist whose pixel lies in the cell's mask.

The grid of all views is one picture `(cell_rows lens_rows, cell_cols lens_cols, channel)` that shows view (u, v) at
grid column u and grid row v: `grid[v * lens_rows + lens_row, u * lens_cols + lens_col]`. The leftmost eye is at the
left, the uppermost at the top; views that do not exist are black. The layout is always the orthoscopic sheet's.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout, Pixel, check_sheet
from lippmann.lightfield.sheet.cells import Run, cells, put_pixels, run_px, runs, sheet_of


def view(ortho: NDArray[Pixel], layout: CellLayout, u: int, v: int) -> NDArray[Pixel]:
    """Return one view, `(lens_rows, lens_cols, channel)`, on the square lattice without copying.

    Parameters
    ----------
    ortho
        Orthoscopic sheet `(rows, cols, channel)`, any dtype.
    layout
        How its pixels lie under the lenses.
    u, v
        Which view: u from the left eye to the right, v from the top down.

    Raises
    ------
    LayoutError
        If there is no such view, or the sheet is not of this layout.
    """
    _check_view(layout, u, v)
    row, col = layout.cell_rows - 1 - v, layout.cell_cols - 1 - u
    if not layout.interlocks:  # the cells are the sheet's memory with other axes
        return cells(ortho, layout)[:, :, row, col]
    check_sheet(ortho, layout)
    gathered = np.empty((layout.lens_rows, layout.lens_cols, ortho.shape[2]), dtype=ortho.dtype)
    for first in range(min(2, layout.lens_rows)):
        gathered[first::2] = run_px(ortho, layout, Run(first, row, slice(col, col + 1)))[:, :, 0]
    return gathered


def views_grid(ortho: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return all views as one picture; the inverse of `interlace`.

    Parameters
    ----------
    ortho
        Orthoscopic sheet `(rows, cols, channel)`, any dtype.
    layout
        How its pixels lie under the lenses.

    Returns
    -------
    NDArray
        `(cell_rows lens_rows, cell_cols lens_cols, channel)`, contiguous; black where there is no view.
    """
    if not layout.interlocks:  # the cells are the sheet's memory with other axes
        shown = np.empty((layout.rows, layout.cols, ortho.shape[2]), dtype=ortho.dtype)
        by_view = cells(ortho, layout)[:, :, ::-1, ::-1].transpose(0, 2, 3, 1, 4)
        put_pixels(_by_view(shown, layout).swapaxes(0, 1), by_view)
        return shown
    check_sheet(ortho, layout)
    grid = np.zeros((*grid_size(layout), ortho.shape[2]), dtype=ortho.dtype)
    for run in runs(layout):
        put_pixels(_views_of_run(grid, layout, run), run_px(ortho, layout, run))
    return grid


def grid_size(layout: CellLayout) -> tuple[int, int]:
    """Return the (rows, cols) of the grid of views, px."""
    return layout.cell_rows * layout.lens_rows, layout.cell_cols * layout.lens_cols


def view_of_grid(grid: NDArray[Pixel], layout: CellLayout, u: int, v: int) -> NDArray[Pixel]:
    """Return one view of a grid of views without copying; see `view`.

    Parameters
    ----------
    grid
        All views as one picture, as `views_grid` returns it.
    layout
        The lenses over the sheet.
    u, v
        The view.

    Returns
    -------
    NDArray
        `(lens_rows, lens_cols, channel)`.
    """
    _check_view(layout, u, v)
    _check_grid(grid, layout)
    row, col = v * layout.lens_rows, u * layout.lens_cols
    return grid[row : row + layout.lens_rows, col : col + layout.lens_cols]


def interlace(grid: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return the orthoscopic sheet whose views a grid shows; the inverse of `views_grid`.

    Parameters
    ----------
    grid
        `(cell_rows lens_rows, cell_cols lens_cols, channel)`, any dtype; views that do not exist are ignored.
    layout
        The lenses over the sheet.

    Returns
    -------
    NDArray
        `(rows, cols, channel)`; zero where there is no lens.
    """
    _check_grid(grid, layout)
    if not layout.interlocks:  # the cells are the sheet's memory with other axes
        return sheet_of(_by_view(grid, layout).transpose(1, 3, 0, 2, 4)[:, :, ::-1, ::-1], layout)
    ortho = np.zeros((layout.rows, layout.cols, grid.shape[2]), dtype=grid.dtype)
    for run in runs(layout):
        run_px(ortho, layout, run)[:] = _views_of_run(grid, layout, run)
    return ortho


def view_numbers(layout: CellLayout) -> tuple[tuple[int, int], ...]:
    """Return (u, v) of every view that exists, by rows.

    >>> view_numbers(CellLayout(lens_rows=1, lens_cols=1, px_per_lens=2, lattice="hexagonal"))
    ((0, 1), (1, 1), (0, 2), (1, 2))
    """
    # The mask is the same turned by 180 degrees, so it says of views what it says of pixels.
    return tuple((int(u), int(v)) for v, u in np.argwhere(layout.mask))


def successive_views(layout: CellLayout, *, backward: bool = False) -> Iterator[tuple[int, int]]:
    """Yield (u, v) of all views in serpentine order: a video of them has no jumps.

    The order runs to the right along the top row of views, back along the next, and so on down; every step leads to a
    neighbour. Rows of hexagonal views differ in length, so a step to the next row may also go sideways, by at most two.

    Parameters
    ----------
    layout
        The lenses over the sheet.
    backward
        True to yield the order from its end; if every second frame of a sequence goes backward, there is no jump
        between frames either.

    Examples
    --------
    >>> list(successive_views(CellLayout(lens_rows=1, lens_cols=1, px_per_lens=2)))
    [(0, 0), (1, 0), (1, 1), (0, 1)]
    """
    walk: list[tuple[int, int]] = []
    for number, (_, row) in enumerate(groupby(view_numbers(layout), key=lambda view: view[1])):
        walk.extend(row if number % 2 == 0 else reversed(list(row)))
    yield from reversed(walk) if backward else walk


def centre(layout: CellLayout) -> tuple[int, int]:
    """Return the (u, v) of the view nearest the lenses' axes; of two or four, the one to the right and below.

    >>> centre(CellLayout(lens_rows=1, lens_cols=1, px_per_lens=8))
    (4, 4)
    """
    return layout.cell_cols // 2, layout.cell_rows // 2


def _by_view(grid: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return a grid as `(v, lens_row, u, lens_col, channel)`: a view of its memory."""
    return grid.reshape(layout.cell_rows, layout.lens_rows, layout.cell_cols, layout.lens_cols, grid.shape[2])


def _views_of_run(grid: NDArray[Pixel], layout: CellLayout, run: Run) -> NDArray[Pixel]:
    """Return where a grid shows the pixels of a run, `(lens_row, lens_col, px, channel)`: a view of its memory."""
    shown = _by_view(grid, layout)[layout.cell_rows - 1 - run.cell_row, run.first_lens_row :: 2, ::-1]
    return shown[:, run.cell_cols].transpose(0, 2, 1, 3)


def _check_view(layout: CellLayout, u: int, v: int) -> None:
    last_u, last_v = layout.cell_cols - 1, layout.cell_rows - 1
    if not (0 <= u <= last_u and 0 <= v <= last_v):
        raise LayoutError(f"expected a view from (0, 0) to ({last_u}, {last_v}), got ({u}, {v})")
    if not layout.has_view(u, v):
        raise LayoutError(f"expected a view whose pixel lies under a hexagonal lens, got ({u}, {v})")


def _check_grid(grid: NDArray[Pixel], layout: CellLayout) -> None:
    if grid.ndim != 3 or grid.shape[:2] != grid_size(layout):
        rows, cols = grid_size(layout)
        raise LayoutError(f"expected a grid of views of {rows} x {cols} px for {layout}, got shape {grid.shape}")
