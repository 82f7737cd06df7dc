"""SPOC, the smart pseudoscopic-to-orthoscopic conversion: a capture becomes the integral image of another display.

Navarro, Martinez-Cuenca, Saavedra, Martinez-Corral, Javidi, *3D integral imaging display by smart
pseudoscopic-to-orthoscopic conversion (SPOC)*, Optics Express 18(25), 25573 (2010), here for either lattice on either
side, axes and middles the same. Lenses are pinholes, and z grows toward the observer from the pinholes of the capture:

1. From a pixel of the display, a off its lens's axis, light leaves through the pinhole at (X, z_d) with slope -a / g.
   That ray meets the reference plane at x_r, and the plane of the capture's pinholes, z = 0, nearest to one at X_i.
2. The ray from x_r through X_i goes on to the capture's pixels: the one that it meets is taken, if it is of that lens.

What lies in the reference plane comes out where it was, to the pixel of the capture; the further from it, the coarser:
there the capture's lenses show the same place from X_i instead of from where the ray passes, up to half a pitch beside.
With equal arrays and no distance this is the half-turn of the cells, bit by bit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.bands import Sheet, at_least_two, part_layout, part_rows
from lippmann.lightfield.sheet.cells import sheet_of
from lippmann.lightfield.sheet.interpolation import SNAP
from lippmann.lightfield.sheet.pinholes import PinholeArray


@dataclass(frozen=True)
class SpocSheet:
    """The orthoscopic integral image of a display, computed in parts; see the module."""

    pseudoscopic: Sheet
    """The capture as it was, with its picture upright."""
    capture: PinholeArray
    """The pinhole array of the capture."""
    display: PinholeArray
    distance_mm: float
    """z of the display's pinholes, z_d: what was at s before the capture's is at s - z_d before the display's."""
    reference_mm: float
    """z of the reference plane: where the scene should be sharpest; not 0."""

    def __post_init__(self) -> None:
        """Refuse a capture of another layout, and planes that are not finite."""
        if self.pseudoscopic.layout != self.capture.layout:
            raise LayoutError(f"expected a sheet of {self.capture.layout}, got one of {self.pseudoscopic.layout}")
        if not math.isfinite(self.distance_mm):
            raise LayoutError(f"expected a distance of the display in mm, got {self.distance_mm:g}")
        if not math.isfinite(self.reference_mm) or self.reference_mm == 0:
            raise LayoutError(
                f"expected a reference plane in mm off the capture's own array, at 0, got {self.reference_mm:g}"
            )

    @property
    def layout(self) -> CellLayout:
        """The layout of the sheet of the display."""
        return self.display.layout

    def part(self, first: int, stop: int) -> NDArray[Any]:
        """Return the pixel rows of some lens rows; zero where the capture has no light for them; see `Sheet.part`.

        No more lens rows of the capture are held than the rays of these lens rows may meet.
        """
        wide_first, wide_stop = at_least_two(self.layout, first, stop)
        low, high = self._met(wide_first, wide_stop)
        pixels = self.pseudoscopic.part(low, high)
        made = [self._cells(lens_row, pixels, low) for lens_row in range(wide_first, wide_stop)]
        sheet = sheet_of(np.stack(made), part_layout(self.layout, wide_first, wide_stop))
        start, end = (row - wide_first * self.layout.row_px for row in part_rows(self.layout, first, stop))
        return sheet[start:end]

    def _met(self, first: int, stop: int) -> tuple[int, int]:
        """Return [first, stop) of the capture's lens rows that rays of some lens rows may meet."""
        reach_mm = np.abs(self._slopes()[0] * self.distance_mm).max()
        _, down_mm = self.display.lenses_mm.centre_of(np.array([first, stop - 1]), np.array(0))
        return self.capture.lenses_mm.lens_rows_near(down_mm + np.array([-reach_mm, reach_mm]))

    def _slopes(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the slopes of the rays of a cell's pixels, (downward of its rows, to the right of its cols)."""
        layout = self.layout
        sides = zip((layout.cell_rows, layout.cell_cols), self.display.pixel_mm, strict=True)
        offsets_mm = ((np.arange(px, dtype=np.float64) - (px - 1) / 2) * px_mm for px, px_mm in sides)
        down, right = (-offset_mm / self.display.gap_mm for offset_mm in offsets_mm)
        return down, right

    def _cells(self, lens_row: int, pixels: NDArray[Any], low: int) -> NDArray[Any]:
        """Return the cells of a lens row, `(lens_col, cell_row, cell_col, channel)`, of pixels from lens row `low` on.

        With D the slope of a ray, and e how far past the pinhole at X_i it passes, x_r - X_i = e + D z_r.
        """
        layout = self.capture.layout
        slope_down, slope_right = self._slopes()[0][:, np.newaxis], self._slopes()[1]
        right_mm, down_mm = self.display.lenses_mm.centre_of(np.array(lens_row), np.arange(self.layout.lens_cols))
        lenses = self.capture.lenses_mm
        lens = lenses.nearest(
            right_mm[:, np.newaxis, np.newaxis] - slope_right * self.distance_mm,
            down_mm - slope_down * self.distance_mm,
        )
        row, has_row = self._pixel(lens.down, slope_down, self.capture.pixel_mm[0], layout.cell_rows)
        col, has_col = self._pixel(lens.right, slope_right, self.capture.pixel_mm[1], layout.cell_cols)
        there = lenses.has(lens.lens_row, lens.lens_col)
        shifts_px = np.array([layout.shift_px(0), layout.shift_px(1)])
        top = np.where(there, lens.lens_row - low, 0) * layout.row_px
        left = np.where(there, lens.lens_col * layout.px_per_lens + shifts_px[lens.lens_row % 2], 0)
        taken: NDArray[Any] = pixels[top + row, left + col]
        taken[~(there & has_row & has_col & layout.mask[row, col])] = 0
        return taken

    def _pixel(
        self, past_mm: NDArray[np.float64], slope: NDArray[np.float64], px_mm: float, px: int
    ) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
        """Return the pixel of a cell that is met on one axis, and whether there is one; of two the one further on."""
        back = slope + past_mm / self.reference_mm
        # Rounded, so that half-way is half-way whatever the errors of the arithmetic.
        at = np.round((back * self.capture.gap_mm / px_mm + (px - 1) / 2) * SNAP) / SNAP
        number = np.floor(at + 0.5).astype(np.intp)
        there = (number >= 0) & (number < px)
        return np.where(there, number, 0), there
