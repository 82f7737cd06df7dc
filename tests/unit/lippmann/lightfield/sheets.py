"""Sheets and layouts for the tests of lippmann.lightfield, and where lenses stand by plain geometry."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage

SQUARE_LAYOUTS = st.builds(
    CellLayout,
    lens_rows=st.integers(1, 5),
    lens_cols=st.integers(1, 5),
    px_per_lens=st.integers(1, 5),
)


def image_of(
    pixels: NDArray[Any], layout: CellLayout, *, pitch_mm: float = 1.0, focal_length_mm: float = 3.3
) -> IntegralImage:
    """Return an orthoscopic image; whole numbers become floating ones."""
    light = pixels if np.issubdtype(pixels.dtype, np.floating) else pixels.astype(np.float64)
    return IntegralImage(pixels=light, layout=layout, pitch_mm=pitch_mm, focal_length_mm=focal_length_mm)


@st.composite
def _hexagonal(draw: st.DrawFn) -> CellLayout:
    lens_rows = draw(st.integers(1, 5))
    return CellLayout(
        lens_rows=lens_rows,
        lens_cols=draw(st.integers(1, 4)),
        px_per_lens=draw(st.sampled_from([2, 4, 6, 8, 10, 14])),
        lattice="hexagonal",
        first_row_shifted=lens_rows > 1 and draw(st.booleans()),
    )


HEXAGONAL_LAYOUTS = _hexagonal()
LAYOUTS = SQUARE_LAYOUTS | HEXAGONAL_LAYOUTS
CHANNELS = st.integers(1, 4)
DTYPES = st.sampled_from([np.uint8, np.uint16, np.float16, np.float32])

ROW_PITCH = math.sqrt(3) / 2


def numbered_sheet(layout: CellLayout, channels: int = 3, dtype: type = np.float32) -> NDArray[Any]:
    """Return a sheet in which, dtype permitting, every number differs, and zero where there is no lens."""
    count = layout.rows * layout.cols * channels
    numbers = np.arange(1, count + 1).reshape(layout.rows, layout.cols, channels)
    numbers[lens_numbers(layout) < 0] = 0
    return numbers.astype(dtype)


def lens_centres(layout: CellLayout) -> NDArray[np.float64]:
    """Return the lenses' centres as (x, y) in pitches from the sheet's top left corner, `(lens_row, lens_col, 2)`."""
    row, col = np.mgrid[: layout.lens_rows, : layout.lens_cols].astype(float)
    if layout.lattice == "square":
        return np.stack((col + 0.5, row + 0.5), axis=-1)
    shifted = (row % 2 != layout.first_row_shifted) & (layout.lens_rows > 1)
    top = layout.overhang_px / layout.row_px * ROW_PITCH
    return np.stack((col + 0.5 + 0.5 * shifted, top + (row + 0.5) * ROW_PITCH), axis=-1)


def px_centres(layout: CellLayout, k: int = 1) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the (x, y) of the pixels' centres, each divided into k x k, in pitches from the top left corner."""
    height = 1.0 if layout.lattice == "square" else ROW_PITCH
    x = (np.arange(layout.cols * k) + 0.5) / (layout.px_per_lens * k)
    y = (np.arange(layout.rows * k) + 0.5) / (layout.row_px * k) * height
    return x, y


def lens_numbers(layout: CellLayout, k: int = 1) -> NDArray[np.int64]:
    """Return lens_row * lens_cols + lens_col of the lens whose hexagon or square a pixel's centre lies in, else -1.

    A hexagon or a square is where no lens of the endless lattice is nearer, so two more rings of them stand round.
    """
    x, y = (np.broadcast_to(a, (layout.rows * k, layout.cols * k)) for a in _crossed(*px_centres(layout, k)))
    nearest, number = np.full(x.shape, np.inf), np.full(x.shape, -1)
    ring = range(-2, layout.lens_rows + 2), range(-2, layout.lens_cols + 2)
    top_left = lens_centres(layout)[0, 0]
    first_shift = 0.5 if layout.first_row_shifted else 0.0
    for row in ring[0]:
        shift = 0.5 * (row % 2 != layout.first_row_shifted) if layout.lattice == "hexagonal" else 0.0
        height = ROW_PITCH if layout.lattice == "hexagonal" else 1.0
        for col in ring[1]:
            away = np.hypot(x - (top_left[0] + col + shift - first_shift), y - (top_left[1] + row * height))
            real = 0 <= row < layout.lens_rows and 0 <= col < layout.lens_cols
            number[away < nearest] = row * layout.lens_cols + col if real else -1
            nearest = np.minimum(nearest, away)
    return number


def _crossed(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return x[np.newaxis, :], y[:, np.newaxis]
