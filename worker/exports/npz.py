"""NPZ: a zip of NumPy arrays, as `numpy.load` reads it. It carries no date: the same arrays give the same bytes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile

import numpy as np
from numpy.lib.format import write_array
from numpy.typing import NDArray

from worker.whole_file import new_file

_LEVEL = 1
"""The level of deflate. Higher levels take several times as long for a few per cent (measured on half floats)."""


def write_npz(path: Path, arrays: Mapping[str, NDArray[Any]], *, compress: bool) -> None:
    """Write arrays by their names, in this order; none of objects.

    Raises
    ------
    DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    kind = ZIP_DEFLATED if compress else ZIP_STORED
    with new_file(path) as file, ZipFile(file, "w", kind, compresslevel=_LEVEL) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                write_array(member, np.asanyarray(array), allow_pickle=False)
