"""Orthoscopic sheets of flat textures at a depth, by plain geometry: rays through pinholes, one a pixel."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.cells import sheet_of
from tests.unit.lippmann.lightfield.sheets import ROW_PITCH, lens_centres

Texture = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]
"""Light at (x, y) in mm from the middle of the display: to the right, downward."""


def spot(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """A soft point in the middle, about as wide as a lens of 1 mm."""
    light: NDArray[np.float64] = np.exp(-(x**2 + y**2) / (2 * 0.7**2))
    return light


def sheet_of_texture(
    layout: CellLayout, texture: Texture, depth_mm: float, *, pitch_mm: float = 1.0, focal_mm: float
) -> NDArray[np.float32]:
    """Return the sheet `(rows, cols, 1)` whose every pixel shows what its pinhole's ray meets at the depth."""
    row_pitch = ROW_PITCH if layout.lattice == "hexagonal" else 1.0
    middle = np.array([layout.cols / layout.px_per_lens, layout.rows / layout.row_px * row_pitch]) / 2
    lens_x, lens_y = np.moveaxis(lens_centres(layout) - middle, -1, 0)[..., np.newaxis, np.newaxis] * pitch_mm
    down, right = np.mgrid[: layout.cell_rows, : layout.cell_cols].astype(float)
    right = (right - (layout.cell_cols - 1) / 2) / layout.px_per_lens * pitch_mm
    down = (down - (layout.cell_rows - 1) / 2) / layout.row_px * row_pitch * pitch_mm
    light = texture(lens_x - right * depth_mm / focal_mm, lens_y - down * depth_mm / focal_mm)
    return sheet_of(light.astype(np.float32)[..., np.newaxis], layout)
