"""Rearrange pictures in bands of rows: turn them by quarters, and gather all views of a sheet.

Pixels pass through a scratch file, because the first row may become the last.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.sheet.bands import Sheet, bands, view_bands
from lippmann.lightfield.views.views import grid_size
from worker.images.bands.rows import BAND_PX, bands_of_rows
from worker.images.bands.scratch import scratch_rows

BLOCK_PX = 256
"""The columns that are read together when they become rows."""
BAND_ROWS = 64
"""The rows of a band of the turned picture."""


def turned_bands(
    bands: Iterable[NDArray[Any]], *, rows: int, cols: int, quarters: int, bits: int, folder: Path
) -> Iterator[NDArray[Any]]:
    """Yield the bands of a picture turned clockwise.

    Parameters
    ----------
    bands
        From the top: `(some rows, cols, 3)`, uint8 or uint16, `rows` in all.
    rows, cols
        The size of the picture before it is turned, px.
    quarters
        The quarters of a clockwise turn, 0 to 3; 0 yields the bands unchanged.
    bits
        8 or 16.
    folder
        For the file.

    Raises
    ------
    DiskFull, DiskUnavailable
        If there is no room for the file.
    """
    if quarters == 0:
        yield from bands
        return
    # Blocks of cols one below the other; for half a turn, of all cols.
    wide = cols if quarters == 2 else BLOCK_PX
    lefts = range(0, cols, wide)
    with scratch_rows(folder, rows=rows * len(lefts), cols=wide, channels=3, dtype=f"uint{bits}") as kept:
        top = 0
        for band in bands:
            for number, left in enumerate(lefts):
                block = band[:, left : left + wide]
                kept.write(number * rows + top, np.pad(block, ((0, 0), (0, wide - block.shape[1]), (0, 0))))
            top += len(band)
        if quarters == 2:
            for stop in range(rows, 0, -BAND_ROWS):
                yield kept.read(max(0, stop - BAND_ROWS), stop)[::-1, ::-1]
            return
        blocks = list(enumerate(lefts))
        for number, left in blocks if quarters == 1 else reversed(blocks):
            block = kept.read(number * rows, (number + 1) * rows)[:, : cols - left]
            turned = np.rot90(block, -quarters)
            for top in range(0, len(turned), BAND_ROWS):
                yield turned[top : top + BAND_ROWS]


def views_rows(sheet: Sheet, scratch: Path | None = None) -> Iterator[NDArray[Any]]:
    """Yield the rows of `views_grid`, top down, in bands.

    Every lens row has a part in every view, so of a sheet of several bands the views are kept aside on disk first.

    Parameters
    ----------
    sheet
        Orthoscopic.
    scratch
        A folder for them; else the system's.

    Raises
    ------
    DiskFull, DiskUnavailable
        If they cannot be kept aside.
    """
    layout = sheet.layout
    rows, cols = grid_size(layout)
    made = view_bands(sheet, BAND_PX)
    if len(bands(layout, BAND_PX)) == 1:
        _, whole = next(made)
        yield whole.reshape(rows, cols, -1)
        return
    _, band = first = next(made)
    with scratch_rows(scratch, rows=rows, cols=cols, channels=band.shape[-1], dtype=band.dtype) as kept:
        for lens_row, views in chain((first,), made):
            for v, view_row in enumerate(views):
                kept.write(v * layout.lens_rows + lens_row, view_row)
        for start, stop in bands_of_rows(rows, cols * band.shape[-1] * band.dtype.itemsize):
            yield kept.read(start, stop)
