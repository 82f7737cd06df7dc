"""Which pixel lies under which lens: the sheet `(rows, cols, channel)` and the cells it divides into.

On the square lattice cells are squares that fill the sheet. On the hexagonal one lens rows stand m = `row_px` apart and
every other one is shifted by half a lens; hexagons reach o = `overhang_px` rows into the lens rows above and below, so
the box round a cell is m + 2 o rows high, and the pixels of the box that are the lens's own are its `mask`. The centre
of lens (r, c) is at row o + r m + m / 2, col c n + n / 2, and n / 2 further right where its row is shifted.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.hexagonal_pixels import ROW_PITCH, hexagon_mask, hexagonal_rows, overhang_rows

Pixel = TypeVar("Pixel", bound=np.generic)

Lattice = Literal["square", "hexagonal"]

SQUARE_PX = 0.005
"""By so much the pitches of rows and cols may differ for the same lenses, as a sheet has a whole number of pixels."""


@dataclass(frozen=True)
class CellLayout:
    """A lattice of lenses over whole pixels."""

    lens_rows: int
    lens_cols: int
    px_per_lens: int
    """Across a lens, n."""
    lattice: Lattice = "square"
    first_row_shifted: bool = False
    """Hexagonal: the even lens rows are those half a lens further right, not the odd ones."""

    def __post_init__(self) -> None:
        """Refuse what is not a lattice."""
        if min(self.lens_rows, self.lens_cols, self.px_per_lens) < 1:
            raise LayoutError(f"expected at least one lens of at least one px, got {self}")
        if self.lattice == "hexagonal" and self.px_per_lens % 2:
            raise LayoutError(f"expected an even number of px across a hexagonal lens, got {self.px_per_lens}")
        if self.first_row_shifted and (self.lattice == "square" or self.lens_rows == 1):
            raise LayoutError(f"expected a shifted row among several hexagonal ones only, got {self}")

    def __str__(self) -> str:
        kind = "lenses" if self.lattice == "square" else "hexagonal lenses"
        return f"{self.lens_rows} x {self.lens_cols} {kind} of {self.px_per_lens} px"

    @property
    def row_px(self) -> int:
        """From one lens row to the next, m, px."""
        return self.px_per_lens if self.lattice == "square" else hexagonal_rows(self.px_per_lens)

    @property
    def overhang_px(self) -> int:
        """By how many rows a cell's box reaches into the next lens row, o, px."""
        return 0 if self.lattice == "square" else overhang_rows(self.row_px)

    @property
    def rows(self) -> int:
        """Height of the sheet, px."""
        return self.lens_rows * self.row_px + 2 * self.overhang_px

    @property
    def cols(self) -> int:
        """Width of the sheet, px."""
        shifted = self.lattice == "hexagonal" and self.lens_rows > 1
        return self.lens_cols * self.px_per_lens + (self.px_per_lens // 2 if shifted else 0)

    @property
    def px(self) -> int:
        """Pixels in all."""
        return self.rows * self.cols

    @property
    def cell_rows(self) -> int:
        """Height of a cell's box, px."""
        return self.row_px + 2 * self.overhang_px

    @property
    def cell_cols(self) -> int:
        """Width of a cell's box, px."""
        return self.px_per_lens

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Which pixels of a cell's box are the lens's own, `(cell_rows, cell_cols)`: for a square lens all."""
        if self.lattice == "square":
            return np.broadcast_to(np.True_, (self.cell_rows, self.cell_cols))
        return hexagon_mask(px_per_lens=self.px_per_lens, row_px=self.row_px, overhang_px=self.overhang_px)

    @property
    def row_edges(self) -> tuple[int, ...]:
        """The pixel rows where tiles may be cut, lens_rows + 1: between lens rows, and the sheet's own edges."""
        between = (self.overhang_px + row * self.row_px for row in range(1, self.lens_rows))
        return (0, *between, self.rows)

    @property
    def col_edges(self) -> tuple[int, ...]:
        """The pixel cols where tiles may be cut, lens_cols + 1: between lenses of the rows that are not shifted."""
        return (*(col * self.px_per_lens for col in range(self.lens_cols)), self.cols)

    def pixel_mm(self, pitch_mm: float) -> tuple[float, float]:
        """Return a pixel's (height, width) where lenses have this pitch."""
        row_pitch = 1.0 if self.lattice == "square" else ROW_PITCH
        return pitch_mm * row_pitch / self.row_px, pitch_mm / self.px_per_lens

    def shift_px(self, lens_row: int) -> int:
        """Return how much further right a lens row stands than the leftmost ones, px."""
        shifted = self.lattice == "hexagonal" and self.lens_rows > 1 and lens_row % 2 != self.first_row_shifted
        return self.px_per_lens // 2 if shifted else 0

    def turned(self) -> CellLayout:
        """Return the layout of the sheet turned by 180 degrees: of an odd number of shifted rows, the others are."""
        odd = self.lattice == "hexagonal" and self.lens_rows > 1 and self.lens_rows % 2 == 1
        return replace(self, first_row_shifted=not self.first_row_shifted) if odd else self


def check_sheet(sheet: NDArray[Pixel], layout: CellLayout) -> None:
    """Refuse an array that is not a sheet of this layout.

    Raises
    ------
    LayoutError
        Naming the size that came and the lenses it should divide among.
    """
    if sheet.ndim != 3:
        raise LayoutError(f"expected a sheet (rows, cols, channel), got an array of shape {sheet.shape}")
    check_size(sheet.shape[0], sheet.shape[1], layout)


def check_size(rows: int, cols: int, layout: CellLayout) -> None:
    """Refuse a size in px that is not that of a sheet of this layout; see `check_sheet`."""
    if (rows, cols) != (layout.rows, layout.cols):
        raise LayoutError(f"{rows} x {cols} px do not divide among {layout}{_fitting(rows, cols, layout)}")


def _fitting(rows: int, cols: int, layout: CellLayout) -> str:
    """Return the pitch at which as many lenses do fill a size in px, if there is one, as the end of a sentence."""
    pitch_px = cols / layout.cols * layout.px_per_lens
    row_pitch_px = rows / layout.rows * layout.px_per_lens
    if abs(row_pitch_px / pitch_px - 1) > SQUARE_PX:
        return ""
    return f"; a pitch of {(pitch_px + row_pitch_px) / 2:.4g} px fits, for which lippmann import makes whole cells"
