"""PFM: one channel of 32-bit floats.

A header of three lines, `Pf`, `<cols> <rows>` and `-1` (the sign says: little endian), then the rows **from the bottom
up** (Debevec, *PFM: Portable FloatMap*, of HDR Shop; netpbm's pfm(5)). Any number goes, NaN too.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import OutputError
from worker.whole_file import new_file


def write_pfm(path: Path, values: NDArray[np.floating[Any]]) -> None:
    """Write values `(rows, cols)`, row 0 at the top, as little-endian PFM.

    Raises
    ------
    OutputError, StoreFull, StoreUnavailable
        If it cannot be written, and then no part of it is left.
    """
    if values.ndim != 2 or values.size == 0:
        raise OutputError(f"expected values (rows, cols) for a PFM, got an array of shape {values.shape}")
    rows, cols = values.shape
    with new_file(path) as file:
        file.write(f"Pf\n{cols} {rows}\n-1\n".encode())
        file.write(np.ascontiguousarray(values[::-1], dtype="<f4").data)
