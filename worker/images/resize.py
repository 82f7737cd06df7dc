"""Another size, by a named filter."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenImageIO import FLOAT, ROI, ImageBuf, ImageBufAlgo

from lippmann.errors import OutputError
from lippmann.job.optics.viewing import Filter


def resize(
    linear: NDArray[np.floating[Any]], *, rows: int, cols: int, filter_name: Filter = "lanczos3"
) -> NDArray[np.float32]:
    """Return a picture in another size.

    Parameters
    ----------
    linear
        `(rows, cols, channel)`, floating, linear light.
    rows, cols
        The new size, px.
    filter_name
        The reconstruction filter.

    Returns
    -------
    NDArray
        `(rows, cols, channel)`, float32. Filters with negative lobes may go below 0 and above the brightest pixel.

    Raises
    ------
    OutputError
        If OpenImageIO cannot do it.
    """
    if min(rows, cols) < 1:
        raise OutputError(f"expected a size of at least 1 x 1 px, got {rows} x {cols}")
    source = ImageBuf(np.ascontiguousarray(linear, dtype=np.float32))
    resized = ImageBufAlgo.resize(source, filter_name, roi=ROI(0, cols, 0, rows))
    if resized.has_error:
        raise OutputError(f"cannot resize to {rows} x {cols} px: {resized.geterror()}")
    return np.asarray(resized.get_pixels(FLOAT), dtype=np.float32)
