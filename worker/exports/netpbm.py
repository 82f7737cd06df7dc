"""PPM of more than 8 bits: `P6`, cols, rows and the highest code, then the codes, two bytes each, the high one first.

netpbm's ppm(5). JPEG Pleno's light fields are such files of 10 bits (highest code 1023).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import OutputError
from worker.whole_file import new_file


def write_ppm(path: Path, codes: NDArray[np.uint16], *, bits: int) -> None:
    """Write codes `(rows, cols, 3)` of 9 to 16 bits.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    highest = 2**bits - 1
    if codes.ndim != 3 or codes.shape[2] != 3 or codes.size == 0 or codes.dtype != np.uint16 or not 9 <= bits <= 16:
        raise OutputError(f"expected codes (rows, cols, 3) of 9 to 16 bits, got {codes.dtype} {codes.shape} of {bits}")
    if int(codes.max()) > highest:
        raise OutputError(f"expected codes of at most {highest}, got {codes.max()}")
    rows, cols = codes.shape[:2]
    with new_file(path) as file:
        file.write(f"P6\n{cols} {rows}\n{highest}\n".encode())
        file.write(codes.astype(">u2").tobytes())


def write_pfm(path: Path, values: NDArray[np.floating[Any]]) -> None:
    """Write values `(rows, cols)` or `(rows, cols, 3)`, row 0 at the top, as little-endian PFM.

    Raises
    ------
    OutputError, DiskFull, DiskUnavailable
        If it cannot be written, and then no part of it is left.
    """
    encoded = encoded_pfm(values)
    with new_file(path) as file:
        file.write(encoded)


def encoded_pfm(values: NDArray[np.floating[Any]]) -> bytes:
    """Encode values `(rows, cols)` or `(rows, cols, 3)`, row 0 at the top, as little-endian PFM.

    Raises
    ------
    OutputError
        If the values have another shape, or there are none.
    """
    if values.shape[2:] not in ((), (3,)) or values.ndim < 2 or values.size == 0:
        expected = "values (rows, cols) or (rows, cols, 3) for a PFM"
        raise OutputError(f"expected {expected}, got an array of shape {values.shape}")
    rows, cols = values.shape[:2]
    header = f"{'Pf' if values.ndim == 2 else 'PF'}\n{cols} {rows}\n-1\n"
    return header.encode() + np.ascontiguousarray(values[::-1], dtype="<f4").tobytes()
