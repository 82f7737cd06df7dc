"""Perspectives: the light that goes from under every lens to an eye.

The eye stands at (x, y, L) in millimetres from the middle of the display's array: x to the right, y upward, L in
front. It sees under the lens at x_k the place u_k = -(g / P) (x - x_k) / L pixels from the lens's axis, g the reduced
gap and P the pixel: the further right the eye, the further left. Between pixels light is interpolated linearly, inside
the cell only; nearer to its border than the outermost pixels' centres these go on. A lens whose place lies outside its
own cell is dark and marked: there an observer would see the neighbour's light.

Each lens is one pixel of what is seen, and a pinhole: blur by the lenses is not modelled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import LayoutError
from lippmann.lattice.cell import ON_THE_BORDER
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.sheet.cell_sampling import Places, light_under
from lippmann.lightfield.sheet.interpolation import SNAP
from lippmann.lightfield.sheet.lens_grid import layout_grid


@dataclass(frozen=True)
class Eye:
    """The place of an eye, mm from the middle of the lens array."""

    x_mm: float
    """The distance to the right, mm."""
    y_mm: float
    """The distance upward, mm."""
    distance_mm: float
    """The distance in front of the lens array, mm."""

    def __post_init__(self) -> None:
        """Refuse an eye that does not see the front of the display."""
        numbers = (self.x_mm, self.y_mm, self.distance_mm)
        if not all(map(math.isfinite, numbers)) or self.distance_mm <= 0:
            raise LayoutError(f"expected an eye in front of the display, at a distance above 0 mm, got {self}")

    def __str__(self) -> str:
        return f"({self.x_mm:g}, {self.y_mm:g}, {self.distance_mm:g}) mm"


@dataclass(frozen=True)
class Perspective:
    """The picture that an eye sees, lens by lens."""

    picture: NDArray[np.floating[Any]]
    """`(lens_rows, lens_cols, channel)`; hexagonal: on the lattice's own places, as a view."""
    seen: NDArray[np.bool_]
    """`(lens_rows, lens_cols)`: which lenses show light of their own cell; the others are dark."""


def perspective(image: IntegralImage, eye: Eye) -> Perspective:
    """Return what an eye sees of an integral image whose gap is one focal length; see the module.

    Parameters
    ----------
    image
        An orthoscopic image.
    eye
        The place of the eye.

    Raises
    ------
    LayoutError
        If the image is pseudoscopic.
    """
    image.check_orthoscopic()
    pixels, layout = image.pixels, image.layout
    right, down = places_px(layout, eye, pitch_mm=image.pitch_mm, gap_mm=image.focal_length_mm)
    seen = inside_cells(layout, right, down)
    lens_row, lens_col = np.nonzero(seen)
    picture = np.zeros((*seen.shape, pixels.shape[2]), dtype=np.result_type(pixels.dtype, np.float32))
    places = Places(lens_row, lens_col, down[seen], right[seen])
    picture[seen] = light_under(pixels, layout_grid(layout), places)
    return Perspective(picture=picture, seen=seen)


def places_px(
    layout: CellLayout, eye: Eye, *, pitch_mm: float, gap_mm: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the place under each lens at which an eye looks, (right, down) of the lens's axis, px.

    Parameters
    ----------
    layout
        The lenses over the sheet.
    eye
        The place of the eye.
    pitch_mm, gap_mm
        The pitch of the lenses and the reduced gap, mm.

    Returns
    -------
    tuple
        Two arrays `(lens_rows, lens_cols)`; the places do not end at the border of the cell.
    """
    high_mm, wide_mm = layout.pixel_mm(pitch_mm)
    rows, cols = np.arange(layout.lens_rows), np.arange(layout.lens_cols)
    x_px = _row_shifts(layout) + (cols + 0.5) * layout.px_per_lens - layout.cols / 2
    down_px = layout.overhang_px + (rows[:, np.newaxis] + 0.5) * layout.row_px - layout.rows / 2
    slope = gap_mm / eye.distance_mm
    right = -slope * (eye.x_mm - x_px * wide_mm) / wide_mm
    down = slope * (eye.y_mm + down_px * high_mm) / high_mm
    rounded = (np.round(place * SNAP) / SNAP for place in np.broadcast_arrays(right, down))
    return next(rounded), next(rounded)


def inside_cells(layout: CellLayout, right: NDArray[np.float64], down: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return which places lie in their own cell, or on its border.

    Parameters
    ----------
    layout
        The lenses over the sheet.
    right, down
        The places, px from the axes of the lenses.
    """
    distance = layout.cell.border_distance(right / layout.px_per_lens, down / layout.row_px)
    return np.asarray(distance <= 1 + ON_THE_BORDER)


def _row_shifts(layout: CellLayout) -> NDArray[np.intp]:
    """Return how much further right each lens row stands, px, `(lens_rows, 1)`."""
    return np.array([[layout.shift_px(lens_row)] for lens_row in range(layout.lens_rows)], dtype=np.intp)
