"""Arrays of pinholes before pixels: where they stand, and which one is nearest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.device_hexagons import Nearest, nearest_lenses
from lippmann.lightfield.sheet.interpolation import ON_THE_BORDER


@dataclass(frozen=True)
class PinholeArray:
    """An array of pinholes before pixels. Lengths are from the middle of the array, to the right and downward."""

    layout: CellLayout
    pitch_mm: float
    gap_mm: float
    """From pinholes to pixels."""

    def __post_init__(self) -> None:
        """Refuse what is no length."""
        for name, length_mm in (("pitch", self.pitch_mm), ("gap", self.gap_mm)):
            if not 0 < length_mm < math.inf:
                raise LayoutError(f"expected a positive {name} in mm, got {length_mm:g}")

    @property
    def pixel_mm(self) -> tuple[float, float]:
        """The (height, width) of a pixel."""
        return self.layout.pixel_mm(self.pitch_mm)

    @property
    def row_pitch_mm(self) -> float:
        """From one lens row to the next."""
        return self.pixel_mm[0] * self.layout.row_px

    def down_mm(self, lens_row: int) -> float:
        """Return where a lens row is."""
        return (lens_row - (self.layout.lens_rows - 1) / 2) * self.row_pitch_mm

    def right_mm(self, lens_row: int) -> NDArray[np.float64]:
        """Return where the lenses of a row are, `(lens_col,)`."""
        layout = self.layout
        left_px = layout.shift_px(lens_row) + layout.px_per_lens / 2 - layout.cols / 2
        centres_px = np.arange(layout.lens_cols, dtype=np.float64) * layout.px_per_lens + left_px
        return centres_px * self.pixel_mm[1]

    def nearest(self, down_mm: NDArray[np.float64], right_mm: NDArray[np.float64]) -> Nearest:
        """Return the lens nearest to places, and where these are from its centre, in pitches.

        The lattice goes on beyond the array. Of two lenses in a row it is the right one; of two in two rows, of squares
        the lower, of hexagons the upper. The places broadcast with each other, and so do the parts of the answer.
        """
        layout, down, right = self.layout, down_mm / self.pitch_mm, right_mm / self.pitch_mm
        if layout.lattice == "hexagonal":
            return nearest_lenses(layout, down, right)
        row, past_row = _nearest(down, layout.lens_rows)
        col, past_col = _nearest(right, layout.lens_cols)
        return Nearest(row, col, right=past_col, down=past_row)


def _nearest(at: NDArray[np.float64], count: int) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Return the numbers of the nearest of evenly spaced lenses, and how far past them places are."""
    lens = np.floor(at + count / 2 + ON_THE_BORDER).astype(np.intp)
    return lens, at - (lens - (count - 1) / 2)
