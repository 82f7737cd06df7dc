"""All views of a sheet that need not fit in memory."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from lippmann.lightfield.sheet.bands import Sheet, bands, view_bands
from lippmann.lightfield.views.views import grid_size
from worker.images.rows import BAND_PX, bands_of_rows
from worker.images.scratch import scratch_rows


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
    StoreFull, StoreUnavailable
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
