"""A display in millimetres: a sheet of pixels, lenses in front of it, and the gap between.

The pixels may be the integral image's own or those of a device, of any pitch. The sheet's middle lies under the middle
of the array. Lengths across count from there, to the right and downward, as rows and cols do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.job.optics.viewing import Bare, Surround
from lippmann.lattice.cell import ON_THE_BORDER
from lippmann.lattice.layout import CellLayout, Pixel, check_sheet
from lippmann.lightfield.sheet.device import device_size

Aperture = Literal["full", "inscribed"]
"""The aperture of a lens: the whole cell, or the circle inside."""


@dataclass(frozen=True)
class LensDisplay:
    """A sheet of pixels under an array of thin lenses."""

    layout: CellLayout
    """The lenses; and the pixels under them, where there is no `device_px_mm`."""
    pitch_mm: float
    focal_mm: float
    gap_mm: float
    """Reduced, from the pixels to the lenses."""
    device_px_mm: float | None = None
    """Pitch of a device's square pixels."""
    aperture: Aperture = "full"
    bare: Bare = "clear"
    """The area between round lenses and beyond the array."""
    surround: Surround = "black"
    """The area beyond the sheet."""

    def __post_init__(self) -> None:
        """Refuse a display that cannot be built."""
        lengths = {"pitch": self.pitch_mm, "focal length": self.focal_mm, "gap": self.gap_mm}
        if self.device_px_mm is not None:
            lengths["pixel"] = self.device_px_mm
        for name, length_mm in lengths.items():
            if not 0 < length_mm < math.inf:
                raise LayoutError(f"expected a positive {name} in mm, got {length_mm:g}")

    def check(self, sheet: NDArray[Pixel]) -> None:
        """Refuse pixels of another size than those of this display.

        Raises
        ------
        LayoutError
            If a sheet of the layout has not its size, or one of a device's pixels is smaller than the array.
        """
        if self.device_px_mm is None or sheet.ndim != 3:
            check_sheet(sheet, self.layout)
        else:
            rows, cols = sheet.shape[:2]
            device_size(self.layout, px_per_lens_device=self.pitch_mm / self.device_px_mm, window=(rows, cols))

    @property
    def pixel_mm(self) -> tuple[float, float]:
        """The (height, width) of a pixel."""
        return (self.device_px_mm,) * 2 if self.device_px_mm is not None else self.layout.pixel_mm(self.pitch_mm)

    @property
    def array_mm(self) -> tuple[float, float]:
        """The (height, width) of the array, from one outermost border or corner to the other."""
        return self.layout.lenses_of_pitch(self.pitch_mm).extent


@dataclass(frozen=True)
class LensLine:
    """Evenly spaced centres of lenses on one axis, which go on beyond the array."""

    first_mm: float
    step_mm: float
    count: int

    def nearest(self, at_mm: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the centre nearest to places, mm, and whether there is a lens; of two the one to the right, below."""
        number = np.floor((at_mm - self.first_mm) / self.step_mm + 0.5 + ON_THE_BORDER)
        return self.first_mm + number * self.step_mm, (number >= 0) & (number < self.count)


def lens_lines(display: LensDisplay) -> tuple[tuple[LensLine, LensLine], ...]:
    """Return the rectangular grids that the lattice is made of, each as (down, across).

    The square lattice is one. The hexagonal lattice is two, its even and its odd lens rows, and so whichever of the
    nearest lenses of both is nearer is the nearest of all.
    """
    lenses, period = display.layout.lenses_of_pitch(display.pitch_mm), display.layout.cell.row_period
    right_mm, down_mm = lenses.centre_of(np.arange(period), np.array(0))
    return tuple(
        (
            LensLine(float(down_mm[row]), period * lenses.row_pitch, (lenses.lens_rows + period - row - 1) // period),
            LensLine(float(right_mm[row]), lenses.pitch, lenses.lens_cols),
        )
        for row in range(period)
    )
