"""The pixels of an integral image and the lenses over them: the sheet `(rows, cols, channel)` and its cells.

On the square lattice cells are squares that fill the sheet. On the hexagonal lattice lens rows stand m = `row_px` apart
and every other one is shifted by half a lens. Hexagons reach o = `overhang_px` rows into the lens rows above and below,
so the box round a cell is m + 2 o rows high, and the pixels of the box that belong to the lens are its `mask`. The
centre of lens (r, c) is at row o + r m + m / 2, col c n + n / 2, and n / 2 further right where its row is shifted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Cell, Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.lattice.lenses import LensLattice

Pixel = TypeVar("Pixel", bound=np.generic)

SQUARE_PX = 0.005
"""The part by which the pitches of rows and cols may differ for the same lenses: a sheet has whole pixels."""


@dataclass(frozen=True)
class CellLayout:
    """A lattice of lenses over whole pixels."""

    lens_rows: int
    lens_cols: int
    px_per_lens: int
    """Pixels across a lens, n."""
    lattice: Lattice = "square"
    first_row_shifted: bool = False
    """Hexagonal: the even lens rows are the ones that stand half a lens further right, not the odd ones."""

    def __post_init__(self) -> None:
        """Refuse numbers that make no lattice."""
        if min(self.lens_rows, self.lens_cols, self.px_per_lens) < 1:
            raise LayoutError(f"expected at least one lens of at least one px, got {self}")
        if self.px_per_lens % self.cell.row_period:
            raise LayoutError(f"expected an even number of px across a hexagonal lens, got {self.px_per_lens}")
        if self.first_row_shifted and not self.staggered:
            raise LayoutError(f"expected a shifted row among several hexagonal ones only, got {self}")

    def __str__(self) -> str:
        return f"{self.lens_cols} x {self.lens_rows} {self.cell.plural} of {self.px_per_lens} px"

    @property
    def cell(self) -> Cell:
        """The shape of a lens's cell."""
        return CELLS[self.lattice]

    @property
    def lenses(self) -> LensLattice:
        """The lenses, in pitches from the middle of the array."""
        return self.lenses_of_pitch(1.0)

    def lenses_of_pitch(self, pitch: float) -> LensLattice:
        """Return the lenses with this pitch, in any unit."""
        return LensLattice(self.lens_rows, self.lens_cols, self.lattice, self.first_row_shifted, pitch=pitch)

    @property
    def interlocks(self) -> bool:
        """True on the hexagonal lattice: the boxes of cells overlap, so a cell is no rectangle of the sheet."""
        return self.cell.overhang > 0

    @property
    def staggered(self) -> bool:
        """True if some lens rows are shifted against others."""
        return self.cell.row_shift > 0 and self.lens_rows > 1

    @property
    def row_px(self) -> int:
        """Pixel rows from one lens row to the next, m."""
        return self.cell.row_px(self.px_per_lens)

    @property
    def overhang_px(self) -> int:
        """Pixel rows by which a cell's box reaches into the next lens row, o."""
        return self.cell.overhang_px(self.row_px)

    @property
    def rows(self) -> int:
        """Height of the sheet, px."""
        return self.lens_rows * self.row_px + 2 * self.overhang_px

    @property
    def cols(self) -> int:
        """Width of the sheet, px."""
        return self.lens_cols * self.px_per_lens + (self.px_per_lens // 2 if self.staggered else 0)

    @property
    def px(self) -> int:
        """Number of pixels of the sheet."""
        return self.rows * self.cols

    @property
    def cell_rows(self) -> int:
        """Height of a cell's box, px; the number of rows of views."""
        return self.row_px + 2 * self.overhang_px

    @property
    def cell_cols(self) -> int:
        """Width of a cell's box, px; the number of views in a row."""
        return self.px_per_lens

    @property
    def mask(self) -> NDArray[np.bool_]:
        """True for the pixels of a cell's bounding box that belong to the lens, `(cell_rows, cell_cols)` bool."""
        return self.finer_mask(1)

    def finer_mask(self, k: int) -> NDArray[np.bool_]:
        """Return the mask of a cell's box with every pixel divided into k x k, `(k cell_rows, k cell_cols)` bool."""
        return self.cell.mask(
            px_per_lens=self.px_per_lens * k, row_px=self.row_px * k, overhang_px=self.overhang_px * k
        )

    def has_view(self, u: int, v: int) -> bool:
        """Return True if the view exists: its pixel lies in the cell.

        Parameters
        ----------
        u, v
            The view: u counts from the left eye to the right, v from the top down.

        Returns
        -------
        bool
            False on the hexagonal lattice for a view whose pixel lies in a corner of the cell's box.
        """
        # The mask is the same turned by 180 degrees, so it holds for views as it does for pixels.
        return 0 <= v < self.cell_rows and 0 <= u < self.cell_cols and bool(self.mask[v, u])

    def has_views_on_both_sides(self, u: int, v: int) -> bool:
        """Return True if the views to the left and to the right of a view exist, or those above and below it.

        Parameters
        ----------
        u, v
            The view.

        Returns
        -------
        bool
            False for the views in the corners of the block of views.
        """
        across = self.has_view(u - 1, v) and self.has_view(u + 1, v)
        return across or (self.has_view(u, v - 1) and self.has_view(u, v + 1))

    def views_in_row(self, v: int) -> range:
        """Return u of the views that exist in a row of views; an empty range if there are none."""
        return _filled(self.mask[v]) if 0 <= v < self.cell_rows else range(0)

    def views_in_col(self, u: int) -> range:
        """Return v of the views that exist in a column of views; an empty range if there are none."""
        return _filled(self.mask[:, u]) if 0 <= u < self.cell_cols else range(0)

    @property
    def rows_of_views(self) -> range:
        """The v of the rows in which there are views."""
        return _filled(np.asarray(self.mask.any(axis=1)))

    def overlap_depth(self, focal_length: float) -> float:
        """Return how far from the display neighbouring views of the array still overlap, by one lens at least.

        A point at depth s moves by s / (n f) lenses from one view to the next, and by as many sqrt(3) / 2 / m down on
        the hexagonal lattice; see docs/optics.md, Depth. An array of a single lens has no depth but 0.

        Parameters
        ----------
        focal_length
            The focal length f of the lenses, in any unit.

        Returns
        -------
        float
            The largest distance |s|, in the unit of `focal_length`.
        """
        steps = self.cell.row_pitch / self.row_px, 1 / self.px_per_lens
        views = self.cell_rows, self.cell_cols
        axes = zip(self.square_size(), views, steps, strict=True)
        return min((focal_length * (lenses - 1) / step for lenses, count, step in axes if count > 1), default=math.inf)

    @property
    def row_edges(self) -> tuple[int, ...]:
        """The lens_rows + 1 pixel rows where tiles may be cut: between lens rows, and the sheet's own edges."""
        between = (self.overhang_px + row * self.row_px for row in range(1, self.lens_rows))
        return (0, *between, self.rows)

    @property
    def col_edges(self) -> tuple[int, ...]:
        """The lens_cols + 1 pixel cols where tiles may be cut: between lenses of the rows that are not shifted."""
        return (*(col * self.px_per_lens for col in range(self.lens_cols)), self.cols)

    def pixel_mm(self, pitch_mm: float) -> tuple[float, float]:
        """Return a pixel's (height, width) in mm where lenses have this pitch."""
        return pitch_mm * self.cell.row_pitch / self.row_px, pitch_mm / self.px_per_lens

    def shift_px(self, lens_row: int) -> int:
        """Return how much further right a lens row stands than the leftmost ones, px."""
        if not self.staggered or not self.cell.shift(lens_row, first_row_shifted=self.first_row_shifted):
            return 0
        return self.px_per_lens // 2

    def turned(self) -> CellLayout:
        """Return the layout of the sheet turned by 180 degrees: with an odd number of rows, the others are shifted."""
        others = self.staggered and self.lens_rows % 2 == 1
        return replace(self, first_row_shifted=not self.first_row_shifted) if others else self

    def square_size(self, px_per_lens: int = 1) -> tuple[int, int]:
        """Return the (rows, cols) of a picture of the array on square pixels, so many across a lens.

        >>> CellLayout(lens_rows=90, lens_cols=90, px_per_lens=8, lattice="hexagonal").square_size()
        (78, 90)
        """
        high = round(self.lens_rows * self.cell.row_pitch * px_per_lens)
        return max(1, high), self.lens_cols * px_per_lens


def _filled(there: NDArray[np.bool_]) -> range:
    """Return the places from the first True to the last one."""
    (found,) = np.nonzero(there)
    return range(int(found[0]), int(found[-1]) + 1) if found.size else range(0)


def check_sheet(sheet: NDArray[Pixel], layout: CellLayout) -> None:
    """Refuse an array that is not a sheet of this layout.

    Parameters
    ----------
    sheet
        The array to check, any dtype; a sheet is `(rows, cols, channel)`.
    layout
        The layout that it should have.

    Raises
    ------
    LayoutError
        Naming the size that came and the lenses it should divide among.
    """
    if sheet.ndim != 3:
        raise LayoutError(f"expected a sheet (rows, cols, channel), got an array of shape {sheet.shape}")
    check_size(sheet.shape[0], sheet.shape[1], layout)


def check_size(rows: int, cols: int, layout: CellLayout) -> None:
    """Refuse a size in px that is not that of a sheet of this layout; see `check_sheet`.

    Parameters
    ----------
    rows
        The height, px.
    cols
        The width, px.
    layout
        The layout whose size it should be.
    """
    if (rows, cols) != (layout.rows, layout.cols):
        raise LayoutError(f"{cols} x {rows} px do not divide among {layout}{_fitting(rows, cols, layout)}")


def _fitting(rows: int, cols: int, layout: CellLayout) -> str:
    """Return the pitch at which as many lenses lie on a size in px, if there is one, as the end of a sentence."""
    across, down = cols / layout.cols, rows / layout.rows
    if abs(down / across - 1) > SQUARE_PX:
        return ""
    # The smaller scale, rounded down: the lenses must not reach beyond the picture.
    scale = min(across, down)
    pitch_px, row_pitch_px = (math.floor(1000 * scale * px) / 1000 for px in (layout.px_per_lens, layout.row_px))
    rows_too = f" and a row pitch of {row_pitch_px:.7g} px" if layout.row_px != layout.px_per_lens else ""
    return f"; a pitch of {pitch_px:.7g} px{rows_too} fits, for which lippmann import makes whole cells"
