"""Views: what one eye sees of an orthoscopic integral image, one pixel per lens, and back.

Views are numbered `(u, v)` from `(0, 0)`: **u grows as the eye moves to the right, v as it moves down**, as the
observer of the display sees it. An eye at x_eye sees, under the lens at x_k, the pixel at
u_k = -(g/P) (x_eye - x_k) / L from the lens's axis (g the reduced gap, P the pixel, L the distance): the further right
the eye, the further *left* the pixel, and likewise the further down, the further up. So with n px per lens

    row in cell = n - 1 - v,   col in cell = n - 1 - u.

The grid of all views is one picture `(n lens_rows, n lens_cols, channel)` that shows view (u, v) at grid column u and
grid row v: `grid[v * lens_rows + lens_row, u * lens_cols + lens_col]`. The leftmost eye is at the left, the
uppermost at the top.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from worker.errors import LayoutError
from worker.integral.layout import CellLayout, Pixel, cells, check_sheet, sheet_of


def view(ortho: NDArray[Pixel], layout: CellLayout, u: int, v: int) -> NDArray[Pixel]:
    """Return one view, `(lens_rows, lens_cols, channel)`, without copying.

    Parameters
    ----------
    ortho
        Orthoscopic sheet `(rows, cols, channel)`, any dtype.
    layout
        How its pixels lie under the lenses.
    u, v
        Which view, from 0 to n - 1: u from the left eye to the right, v from the top down.

    Raises
    ------
    LayoutError
        If there is no such view, or the sheet is not of this layout.
    """
    _check_view(layout, u, v)
    last = layout.px_per_lens - 1
    return cells(ortho, layout)[:, :, last - v, last - u]


def views_grid(ortho: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return all n x n views as one picture; the inverse of `interlace`.

    Parameters
    ----------
    ortho
        Orthoscopic sheet `(rows, cols, channel)`, any dtype.
    layout
        How its pixels lie under the lenses.

    Returns
    -------
    NDArray
        `(n lens_rows, n lens_cols, channel)`, contiguous: as large as the sheet.
    """
    by_view = cells(ortho, layout)[:, :, ::-1, ::-1].transpose(2, 0, 3, 1, 4)
    return np.ascontiguousarray(by_view).reshape(layout.rows, layout.cols, ortho.shape[2])


def view_of_grid(grid: NDArray[Pixel], layout: CellLayout, u: int, v: int) -> NDArray[Pixel]:
    """Return one view, `(lens_rows, lens_cols, channel)`, of a grid of views without copying; see `view`."""
    _check_view(layout, u, v)
    check_sheet(grid, layout)
    row, col = v * layout.lens_rows, u * layout.lens_cols
    return grid[row : row + layout.lens_rows, col : col + layout.lens_cols]


def interlace(grid: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return the orthoscopic sheet whose views a grid shows; the inverse of `views_grid`."""
    check_sheet(grid, layout)
    n = layout.px_per_lens
    by_view = grid.reshape(n, layout.lens_rows, n, layout.lens_cols, grid.shape[2])
    return sheet_of(by_view.transpose(1, 3, 0, 2, 4)[:, :, ::-1, ::-1])


def successive_views(layout: CellLayout, *, backward: bool = False) -> Iterator[tuple[int, int]]:
    """Yield (u, v) of all n x n views in the order of a movie without jumps: as one ploughs a field.

    From (0, 0) to the right along the top row of views, back along the next, and so down; every step is to a
    neighbour. `backward` walks the same way from its end, so a sequence whose every second frame goes backward has no
    jump between frames either.

    Examples
    --------
    >>> list(successive_views(CellLayout(lens_rows=1, lens_cols=1, px_per_lens=2)))
    [(0, 0), (1, 0), (1, 1), (0, 1)]
    """
    n = layout.px_per_lens
    for step in range(n * n):
        v, along = divmod(n * n - 1 - step if backward else step, n)
        yield (along if v % 2 == 0 else n - 1 - along), v


def _check_view(layout: CellLayout, u: int, v: int) -> None:
    n = layout.px_per_lens
    if not (0 <= u < n and 0 <= v < n):
        raise LayoutError(f"expected a view from (0, 0) to ({n - 1}, {n - 1}), got ({u}, {v})")


def centre(layout: CellLayout) -> tuple[int, int]:
    """Return the (u, v) of the view nearest the lenses' axes; for an even n, of four the one to the right and below.

    >>> centre(CellLayout(lens_rows=1, lens_cols=1, px_per_lens=8))
    (4, 4)
    """
    return layout.px_per_lens // 2, layout.px_per_lens // 2
