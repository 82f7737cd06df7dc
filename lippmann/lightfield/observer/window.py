"""The part of the array's plane that a picture of a display shows, and its pixels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.job.optics.viewing import MAX_SIZE_PX


@dataclass(frozen=True)
class Window:
    """The part of the array's plane that a picture shows, and its pixels."""

    rows: int
    cols: int
    wide_mm: float
    high_mm: float
    right_mm: float = 0.0
    """The middle of the window, mm to the right of the middle of the display."""
    up_mm: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a window without a size."""
        if not (1 <= self.rows <= MAX_SIZE_PX and 1 <= self.cols <= MAX_SIZE_PX):
            raise LayoutError(f"expected a picture of 1 to {MAX_SIZE_PX} px a side, got {self.cols} x {self.rows}")
        place = (self.wide_mm, self.high_mm, self.right_mm, self.up_mm)
        if not all(map(math.isfinite, place)) or min(self.wide_mm, self.high_mm) <= 0:
            raise LayoutError(f"expected a window of a positive width and height in mm, got {self}")

    @property
    def across_mm(self) -> NDArray[np.float64]:
        """The middles of the columns, mm to the right of the middle of the display."""
        return (np.arange(self.cols, dtype=np.float64) + 0.5) * (self.wide_mm / self.cols) + (
            self.right_mm - self.wide_mm / 2
        )

    @property
    def down_mm(self) -> NDArray[np.float64]:
        """The middles of the rows, mm below the middle of the display."""
        return (np.arange(self.rows, dtype=np.float64) + 0.5) * (self.high_mm / self.rows) - (
            self.up_mm + self.high_mm / 2
        )


def window_of(*, wide_mm: float, high_mm: float, size_px: int, right_mm: float = 0.0, up_mm: float = 0.0) -> Window:
    """Return a window whose pixels are as nearly square as whole numbers of them can be.

    Parameters
    ----------
    wide_mm, high_mm
        The width and height of the window, mm.
    size_px
        The longer side of the picture, px.
    right_mm, up_mm
        The middle of the window, mm from the middle of the display.

    Raises
    ------
    LayoutError
        If the window or its picture has no size.
    """
    shorter = max(1, round(size_px * min(wide_mm, high_mm) / max(wide_mm, high_mm)))
    rows, cols = (shorter, size_px) if wide_mm >= high_mm else (size_px, shorter)
    return Window(rows, cols, wide_mm=wide_mm, high_mm=high_mm, right_mm=right_mm, up_mm=up_mm)
