"""The grid of lenses over a picture, whose pitch need not be a whole number of pixels.

`CellLayout` is for sheets that we rendered or made whole. A sheet on a device's pixels, a scan and a photograph have a
`LensGrid`; `rectify` makes the one into the other. Both say the same of a sheet of ours: `layout_grid`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from lippmann.errors import LayoutError
from lippmann.lattice.cell import Cell, Lattice
from lippmann.lattice.kinds import CELLS
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.device import device_size


@dataclass(frozen=True)
class LensGrid:
    """A lattice of lenses over a picture; places are px from its top left corner, `(down, right)`."""

    lens_rows: int
    lens_cols: int
    pitch_px: float
    """The pitch of the lenses in a row, px."""
    offset_px: tuple[float, float]
    """The centre of lens (0, 0), (down, right), px."""
    lattice: Lattice = "square"
    first_row_shifted: bool = False
    """Hexagonal: the even lens rows are those half a lens further right, not the odd ones."""
    row_pitch_px: float | None = None
    """The distance of neighbouring lens rows, px; None for that of square pixels."""
    turn_deg: float = 0.0
    """The rotation of the lens rows about lens (0, 0), degrees, clockwise in the picture."""

    def __post_init__(self) -> None:
        """Refuse numbers that describe no lattice."""
        if min(self.lens_rows, self.lens_cols) < 1:
            raise LayoutError(f"expected at least one lens, got {self.lens_cols} x {self.lens_rows}")
        numbers = (self.pitch_px, self.row_px, self.turn_deg, *self.offset_px)
        if not all(map(math.isfinite, numbers)) or min(self.pitch_px, self.row_px) <= 0:
            raise LayoutError(
                f"expected a pitch above 0 px both ways, and a place and a turn that are numbers, got {self}"
            )
        self.layout()

    def __str__(self) -> str:
        turned = f", turned by {self.turn_deg:g} degrees" if self.turn_deg else ""
        down, right = self.offset_px
        return (
            f"{self.lens_cols} x {self.lens_rows} {self.cell.plural} of {self.pitch_px:g} px,"
            f" {self.row_px:g} px from row to row, the first at ({right:g}, {down:g}) px{turned}"
        )

    @property
    def cell(self) -> Cell:
        """The shape of a lens's cell."""
        return CELLS[self.lattice]

    @property
    def row_px(self) -> float:
        """The distance of neighbouring lens rows, px."""
        if self.row_pitch_px is not None:
            return self.row_pitch_px
        return self.pitch_px * self.cell.row_pitch

    def shift_pitches(self, lens_row: int) -> float:
        """Return how much further right than row 0 a lens row stands, in pitches: -1/2, 0 or 1/2."""
        here, first = (self.cell.shift(row, first_row_shifted=self.first_row_shifted) for row in (lens_row, 0))
        return here - first

    def layout(self, px_per_lens: int | None = None) -> CellLayout:
        """Return the layout of as many whole cells, with the nearest number of pixels that a lens can have.

        >>> LensGrid(90, 100, 23.622, (11.8, 11.8)).layout()
        CellLayout(lens_rows=90, lens_cols=100, px_per_lens=24, lattice='square', first_row_shifted=False)
        """
        step = self.cell.row_period
        nearest = step * max(1, math.floor(self.pitch_px / step + 0.5))
        return CellLayout(
            self.lens_rows,
            self.lens_cols,
            nearest if px_per_lens is None else px_per_lens,
            lattice=self.lattice,
            first_row_shifted=self.first_row_shifted,
        )


def layout_grid(layout: CellLayout) -> LensGrid:
    """Return the grid of the lenses of a layout on its own sheet."""
    n, m = layout.px_per_lens, layout.row_px
    return LensGrid(
        layout.lens_rows,
        layout.lens_cols,
        pitch_px=n,
        offset_px=(layout.overhang_px + m / 2, layout.shift_px(0) + n / 2),
        lattice=layout.lattice,
        first_row_shifted=layout.first_row_shifted,
        row_pitch_px=m,
    )


def device_grid(
    layout: CellLayout, *, px_per_lens_device: float, window: tuple[int, int] | None = None, margin_px: int = 0
) -> LensGrid:
    """Return the grid of the lenses on the picture that `to_device` makes.

    Parameters
    ----------
    layout
        The lenses over the sheet.
    px_per_lens_device, window, margin_px
        As in `to_device`.

    Raises
    ------
    LayoutError
        As in `device_size`.

    Examples
    --------
    >>> device_grid(CellLayout(100, 100, 24), px_per_lens_device=23.5, margin_px=10).offset_px
    (21.75, 21.75)
    """
    rows, cols = device_size(layout, px_per_lens_device=px_per_lens_device, window=window, margin_px=margin_px)
    right, down = layout.lenses.centres()
    return LensGrid(
        layout.lens_rows,
        layout.lens_cols,
        pitch_px=px_per_lens_device,
        offset_px=(
            rows / 2 + float(down[0, 0]) * px_per_lens_device,
            cols / 2 + float(right[0, 0]) * px_per_lens_device,
        ),
        lattice=layout.lattice,
        first_row_shifted=layout.first_row_shifted,
    )
