"""Sheets whose pixels say which view and which lens they are of, and readers of files by their formats' definitions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.lattice.layout import CellLayout
from tests.srgb import linear_of

STEP = 20
"""Of 10-bit codes, from one view to the next: 1023 has room for 50."""


def view_codes(layout: CellLayout, *, of_lens: bool = True, frame: int = 1) -> NDArray[np.int64]:
    """Return 10-bit codes `(v, u, lens_row, lens_col, 3)`: red tells u, green v, blue the lens, or is 500, and frame.

    Blue is 7 codes higher in every further frame.
    """
    shape = (layout.cell_rows, layout.cell_cols, layout.lens_rows, layout.lens_cols)
    v, u, row, col = np.indices(shape)
    blue = (row * layout.lens_cols + col) * STEP if of_lens else np.full(shape, 500)
    return np.stack((u * STEP, v * STEP, blue + 7 * (frame - 1)), axis=-1)


def coded_sheet(layout: CellLayout, codes: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return the orthoscopic sheet of views, pixel by pixel: the further right the eye, the further left the pixel."""
    sheet = np.zeros((layout.rows, layout.cols, 3))
    for v, u, lens_row, lens_col in np.ndindex(*codes.shape[:4]):
        if layout.mask[layout.cell_rows - 1 - v, layout.cell_cols - 1 - u]:
            row = lens_row * layout.row_px + layout.cell_rows - 1 - v
            col = layout.shift_px(lens_row) + lens_col * layout.px_per_lens + layout.cell_cols - 1 - u
            sheet[row, col] = linear_of(codes[v, u, lens_row, lens_col] / 1023)
    return sheet


def read_pfm(path: Path) -> NDArray[np.float32]:
    """Return a PFM of one or three channels, row 0 at the top."""
    kind, size, scale, data = path.read_bytes().split(b"\n", 3)
    shape = {b"Pf": (), b"PF": (3,)}[kind]
    cols, rows = map(int, size.split())
    values = np.frombuffer(data, dtype="<f4" if float(scale) < 0 else ">f4").reshape(rows, cols, *shape)
    return values[::-1]


def read_ppm(path: Path) -> tuple[NDArray[np.uint16], int]:
    """Return the codes of a PPM of two bytes a code, and the highest there may be."""
    kind, size, highest, data = path.read_bytes().split(b"\n", 3)
    assert kind == b"P6"
    cols, rows = map(int, size.split())
    return np.frombuffer(data, dtype=">u2").reshape(rows, cols, 3).astype(np.uint16), int(highest)
