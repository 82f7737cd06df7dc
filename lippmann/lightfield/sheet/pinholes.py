"""Arrays of pinholes in front of pixels, in millimetres."""

from __future__ import annotations

import math
from dataclasses import dataclass

from lippmann.errors import LayoutError
from lippmann.lattice.layout import CellLayout
from lippmann.lattice.lenses import LensLattice


@dataclass(frozen=True)
class PinholeArray:
    """An array of pinholes before pixels. Lengths are from the middle of the array, to the right and downward."""

    layout: CellLayout
    pitch_mm: float
    gap_mm: float
    """The gap between pinholes and pixels, mm."""

    def __post_init__(self) -> None:
        """Refuse lengths that are not positive."""
        for name, length_mm in (("pitch", self.pitch_mm), ("gap", self.gap_mm)):
            if not 0 < length_mm < math.inf:
                raise LayoutError(f"expected a positive {name} in mm, got {length_mm:g}")

    @property
    def pixel_mm(self) -> tuple[float, float]:
        """The (height, width) of a pixel."""
        return self.layout.pixel_mm(self.pitch_mm)

    @property
    def lenses_mm(self) -> LensLattice:
        """The lenses, in mm from the middle of the array."""
        return self.layout.lenses_of_pitch(self.pitch_mm)
