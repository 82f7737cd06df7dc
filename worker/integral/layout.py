"""Which pixel lies under which lens: the sheet `(rows, cols, channel)` and its cells, both ways without copying."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from worker.errors import LayoutError

Pixel = TypeVar("Pixel", bound=np.generic)


@dataclass(frozen=True)
class CellLayout:
    """A square lattice of lenses, each over a square cell of whole pixels."""

    lens_rows: int
    lens_cols: int
    px_per_lens: int

    def __post_init__(self) -> None:
        """Refuse what is not a lattice."""
        if min(self.lens_rows, self.lens_cols, self.px_per_lens) < 1:
            raise LayoutError(f"expected at least one lens of at least one px, got {self}")

    def __str__(self) -> str:
        return f"{self.lens_rows} x {self.lens_cols} lenses of {self.px_per_lens} px"

    @property
    def rows(self) -> int:
        """Height of the sheet, px."""
        return self.lens_rows * self.px_per_lens

    @property
    def cols(self) -> int:
        """Width of the sheet, px."""
        return self.lens_cols * self.px_per_lens

    @property
    def px(self) -> int:
        """Pixels in all."""
        return self.rows * self.cols


def cells(sheet: NDArray[Pixel], layout: CellLayout) -> NDArray[Pixel]:
    """Return the elemental images of a sheet: a view of its memory, so writing to it writes to the sheet.

    Parameters
    ----------
    sheet
        `(rows, cols, channel)`, any dtype, any strides.
    layout
        How its pixels lie under the lenses.

    Returns
    -------
    NDArray
        `(lens_row, lens_col, row, col, channel)`.

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
    n = layout.px_per_lens
    # Splitting an axis never needs a copy, whatever the strides.
    return sheet.reshape(layout.lens_rows, n, layout.lens_cols, n, sheet.shape[2]).transpose(0, 2, 1, 3, 4)


def sheet_of(cells: NDArray[Pixel]) -> NDArray[Pixel]:
    """Return the sheet that cells make; the inverse of `cells`.

    Parameters
    ----------
    cells
        `(lens_row, lens_col, row, col, channel)`, with square cells.

    Returns
    -------
    NDArray
        `(rows, cols, channel)`; shares memory where the strides allow it.

    Raises
    ------
    LayoutError
        If the array does not have five axes or the cells are not square.
    """
    if cells.ndim != 5 or cells.shape[2] != cells.shape[3]:
        raise LayoutError(f"expected cells (lens_row, lens_col, row, col, channel), got shape {cells.shape}")
    lens_rows, lens_cols, n, _, channels = cells.shape
    return cells.transpose(0, 2, 1, 3, 4).reshape(lens_rows * n, lens_cols * n, channels)


def check_sheet(sheet: NDArray[Pixel], layout: CellLayout) -> None:
    """Refuse an array that is not a sheet of this layout.

    Raises
    ------
    LayoutError
        Naming the size that came and the lenses it should divide among.
    """
    if sheet.ndim != 3:
        raise LayoutError(f"expected a sheet (rows, cols, channel), got an array of shape {sheet.shape}")
    rows, cols = sheet.shape[:2]
    if (rows, cols) != (layout.rows, layout.cols):
        raise LayoutError(
            f"{rows} x {cols} px do not divide among {layout.lens_rows} x {layout.lens_cols} lenses"
            f" of {layout.px_per_lens} px"
        )
