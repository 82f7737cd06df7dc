"""Pixels on disk as plain numbers: written in any order, read in any other, never all in memory."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lippmann.errors import NO_ROOM, DiskFull, DiskUnavailable


class ScratchRows:
    """Rows of pixels `(rows, cols, channel)` in a file without a name; see `scratch_rows`."""

    def __init__(self, file: FileIO, *, rows: int, cols: int, channels: int, dtype: DTypeLike) -> None:
        self.rows, self.cols = rows, cols
        self._file = file
        self._row = (cols, channels)
        self.dtype = np.dtype(dtype)
        self._row_bytes = cols * channels * self.dtype.itemsize

    def write(self, start: int, pixels: NDArray[Any]) -> None:
        """Write rows from row `start` on, `(rows, cols, channel)`."""
        rest = np.ascontiguousarray(pixels, dtype=self.dtype).reshape(-1).view(np.uint8).data
        with _room_asked_for():
            self._file.seek(start * self._row_bytes)
            while rest:
                rest = rest[self._file.write(rest) :]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        """Return the rows [start, stop), which were written before."""
        pixels = np.empty((stop - start, *self._row), dtype=self.dtype)
        rest = pixels.reshape(-1).view(np.uint8).data
        with _room_asked_for():
            self._file.seek(start * self._row_bytes)
            while rest:
                rest = rest[self._file.readinto(rest) :]
        return pixels


@contextmanager
def scratch_rows(
    folder: Path | None, *, rows: int, cols: int, channels: int, dtype: DTypeLike
) -> Iterator[ScratchRows]:
    """Yield a scratch file for rows in a folder, or in the system's temporary folder; it is removed afterwards.

    Raises
    ------
    DiskFull
        If there is no room, here or in `ScratchRows.write`.
    DiskUnavailable
        If the folder cannot be written to.
    """
    with _room_asked_for():
        # Unbuffered, so that a full disk is met in the write that met it.
        file = TemporaryFile(dir=folder, buffering=0)  # noqa: SIM115 - closed below
    with file:
        yield ScratchRows(file, rows=rows, cols=cols, channels=channels, dtype=dtype)


@contextmanager
def _room_asked_for() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        family = DiskFull if error.errno in NO_ROOM else DiskUnavailable
        raise family(f"cannot keep pixels aside: {error.strerror}") from error
