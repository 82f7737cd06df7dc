"""SPOC, the smart pseudoscopic-to-orthoscopic conversion: a capture becomes the integral image of another display.

Navarro, Martinez-Cuenca, Saavedra, Martinez-Corral, Javidi, *3D integral imaging display by smart
pseudoscopic-to-orthoscopic conversion (SPOC)*, Optics Express 18(25), 25573 (2010), here for square lattices whose axes
are the same. Lenses are pinholes, and z grows toward the observer from the pinholes of the capture:

1. From a pixel of the display, a off its lens's axis, light leaves through the pinhole at (X, z_d) with slope -a / g.
   That ray meets the reference plane at x_r, and the capture's plane (z = 0) nearest to some lens there, at X_i.
2. The ray from x_r through X_i goes on to the capture's sensor: that pixel's light is taken.

What lies in the reference plane comes out exactly where it was, to the pixel; the further from it, the coarser. With
the same array and the display at the capture's own place this is the half-turn of the cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.errors import LayoutError
from worker.integral.interpolation import SNAP
from worker.integral.layout import CellLayout, Pixel, check_sheet


@dataclass(frozen=True)
class PinholeArray:
    """A square array of pinholes before pixels."""

    layout: CellLayout
    pitch_mm: float
    gap_mm: float
    """From pinholes to pixels."""

    def __post_init__(self) -> None:
        """Refuse what SPOC is not made for."""
        if self.layout.lattice != "square":
            raise LayoutError(f"expected a square lattice, got {self.layout}")
        if not (0 < self.pitch_mm < math.inf and 0 < self.gap_mm < math.inf):
            raise LayoutError(f"expected a positive pitch and gap in mm, got {self.pitch_mm} and {self.gap_mm}")


def spoc(
    pseudoscopic: NDArray[Pixel],
    capture: PinholeArray,
    display: PinholeArray,
    *,
    distance_mm: float,
    reference_mm: float,
) -> NDArray[Pixel]:
    """Return the orthoscopic integral image of a display; see the module.

    Parameters
    ----------
    pseudoscopic
        The capture's sheet `(rows, cols, channel)`, the picture itself upright; any dtype.
    capture, display
        The two arrays.
    distance_mm
        z of the display's pinholes, z_d: what was at s before the capture's is at s - z_d before the display's.
    reference_mm
        z of the reference plane: where the scene should be sharpest; not 0.

    Returns
    -------
    NDArray
        `(rows, cols, channel)` of the display's layout; zero where the capture has no light for a pixel.

    Raises
    ------
    LayoutError
        If the sheet is not of the capture's layout, or the reference plane is the capture's own.
    """
    check_sheet(pseudoscopic, capture.layout)
    if not (math.isfinite(distance_mm) and math.isfinite(reference_mm)) or reference_mm == 0:
        raise LayoutError(
            f"expected a distance, and a reference plane off the capture's array, in mm, got {distance_mm} and"
            f" {reference_mm}"
        )
    sides = zip(
        (display.layout.lens_rows, display.layout.lens_cols),
        (capture.layout.lens_rows, capture.layout.lens_cols),
        strict=True,
    )
    # Both directions are alike and apart, so a row and a col of the capture for each of the display are all.
    rows, cols = (
        _sources(capture, display, lenses=lenses, of=of, distance_mm=distance_mm, reference_mm=reference_mm)
        for lenses, of in sides
    )
    ortho: NDArray[Pixel] = pseudoscopic[np.maximum(rows, 0)[:, np.newaxis], np.maximum(cols, 0)]
    ortho[rows < 0] = 0
    ortho[:, cols < 0] = 0
    return ortho


def _sources(
    capture: PinholeArray, display: PinholeArray, *, lenses: int, of: int, distance_mm: float, reference_mm: float
) -> NDArray[np.intp]:
    """Return which pixel of the capture each of a line of the display takes, -1 where there is none.

    `lenses` of the display stand in the line, and `of` of the capture.
    """
    n = capture.layout.px_per_lens
    lens_mm = (np.arange(lenses) - (lenses - 1) / 2)[:, np.newaxis] * display.pitch_mm
    slope = -_offsets(display.layout.px_per_lens) * display.pitch_mm / display.gap_mm
    lens = _nearest((lens_mm - slope * distance_mm) / capture.pitch_mm + (of - 1) / 2)
    on_reference_mm = lens_mm + slope * (reference_mm - distance_mm)
    back = (on_reference_mm - (lens - (of - 1) / 2) * capture.pitch_mm) / reference_mm
    px = _nearest(back * capture.gap_mm / capture.pitch_mm * n + (n - 1) / 2)
    lit = (lens >= 0) & (lens < of) & (px >= 0) & (px < n)
    return np.where(lit, lens * n + px, -1).ravel()


def _offsets(px_per_lens: int) -> NDArray[np.float64]:
    """Return the pixels' centres from the lens's axis, in pitches."""
    return (np.arange(px_per_lens) - (px_per_lens - 1) / 2) / px_per_lens


def _nearest(at: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the nearest whole number; half-way, the one above, whatever the rounding errors."""
    return np.floor(np.round(at * SNAP) / SNAP + 0.5).astype(np.intp)
