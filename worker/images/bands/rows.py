"""Pictures that need not fit in memory: rows are read and written a few at a time.

A file is written completely or not left behind. A writer of OpenImageIO may report success on a full disk; but then
the last row cannot be read back, so that is tried.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OpenImageIO import ImageInput, ImageOutput, ImageSpec, geterror

from lippmann.errors import ArtifactBroken, LippmannError, OutputError
from worker.images.read import channel_places, check_channels, checked, opened, utf8_path
from worker.whole_file import new_file

BAND_BYTES = 40_000_000
"""The approximate size of a band: a whole frame of 2400 x 2400 px in half floats."""

BAND_PX = BAND_BYTES // 6
"""The same in pixels of a master, which have three half floats each."""

_DTYPES = {"half": np.float16, "float": np.float32, "uint8": np.uint8, "uint16": np.uint16}
_PROBE_BYTES = 1 << 24


@dataclass
class PictureRows:
    """An open picture; see `open_rows`."""

    rows: int
    cols: int
    dtype: np.dtype[Any]
    _path: Path
    _source: ImageInput
    _channels: list[int]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        """Return the pixel rows [start, stop), `(rows, cols, channel)`, in the picture's dtype.

        Raises
        ------
        ArtifactBroken
            If they are missing or not whole.
        """
        if not 0 <= start < stop <= self.rows:
            raise ArtifactBroken(f"{self._path.name}: expected rows within {self.rows}, got {start} to {stop}")
        source, spec, count = self._source, self._source.spec(), max(self._channels) + 1
        name = next(name for name, dtype in _DTYPES.items() if dtype == self.dtype)
        x, y = spec.x, spec.y  # other programs' pictures need not begin at 0
        if not spec.tile_height:
            pixels = checked(self._path, source, source.read_scanlines(y + start, y + stop, 0, 0, count, name))
        else:
            first, last = start - start % spec.tile_height, min(self.rows, stop + -stop % spec.tile_height)
            read = source.read_tiles(x, x + self.cols, y + first, y + last, 0, 1, 0, count, name)
            tiles = checked(self._path, source, read)
            pixels = tiles.reshape(last - first, self.cols, count)[start - first : stop - first]
        in_order = self._channels == [*range(count)]
        return pixels if in_order else np.ascontiguousarray(pixels[..., self._channels])


@contextmanager
def open_rows(
    path: Path, *, dtype: type[Any] | None = None, channels: Sequence[str] | None = None
) -> Iterator[PictureRows]:
    """Yield a picture of ours whose rows can be read in any order, a few at a time.

    Parameters
    ----------
    path
        EXR or TIFF, whose rows can be found without those before them; see `worker.untrusted.decoded_rows` for others.
    channels
        Their names; without them red, green and blue, which must be the first ones.
    dtype
        The type of the numbers, as in `read_rgb`; by default that of the file: half floats, floats or codes.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If it is not a picture, does not have the three channels, or has numbers of another kind.
    """
    with opened(path) as source:
        places = [0, 1, 2] if channels is None else channel_places(path, source, channels)
        if channels is None:
            check_channels(path, source)
        stored = str(source.spec().format)
        if dtype is None and stored not in _DTYPES:
            raise ArtifactBroken(f"{path.name}: expected numbers of {' or '.join(_DTYPES)}, got {stored}")
        spec = source.spec()
        numbers: np.dtype[Any] = np.dtype(dtype or _DTYPES[stored])
        yield PictureRows(spec.height, spec.width, numbers, path, source, places)


def all_rows(picture: PictureRows) -> Iterator[NDArray[Any]]:
    """Yield the rows of a picture, top down, in bands."""
    for start, stop in bands_of_rows(picture.rows, picture.cols * 3 * picture.dtype.itemsize):
        yield picture.read(start, stop)


def bands_of_rows(rows: int, row_bytes: int) -> Iterator[tuple[int, int]]:
    """Yield [start, stop) of bands of rows of about `BAND_BYTES`, top down.

    >>> list(bands_of_rows(5, BAND_BYTES // 2))
    [(0, 2), (2, 4), (4, 5)]
    """
    step = max(1, BAND_BYTES // row_bytes)
    for start in range(0, rows, step):
        yield start, min(rows, start + step)


def write_rows(
    path: Path,
    bands: Iterable[NDArray[Any]],
    *,
    size: tuple[int, int],
    store_as: str,
    attributes: Mapping[str, str | int | float],
    channels: Sequence[str] = ("R", "G", "B"),
) -> None:
    """Write an EXR from bands of its rows, top down. The same pixels give the same bytes, however they are cut.

    Parameters
    ----------
    path
        The file; writing it is not atomic, but an incomplete file is removed.
    bands
        `(rows, cols, channel)` each; all of one dtype.
    size
        (rows, cols) of the whole.
    store_as
        The type of its numbers, by OpenImageIO's name: `half` or `float`.
    attributes
        Header attributes and settings of the writer.
    channels
        Their names.

    Raises
    ------
    OutputError
        If the picture cannot be written, or the bands are not the rows of its size.
    DiskFull
        If there is no room.
    DiskUnavailable
        If the folder cannot be written to.
    """
    spec = ImageSpec(size[1], size[0], len(channels), store_as)
    spec.channelnames = tuple(channels)
    for name, value in attributes.items():
        # A header holds UTF-8; what is not, such as a file name of another encoding, is escaped.
        spec.attribute(name, value.encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else value)
    with new_file(path):
        _write(path, bands, spec)


def _write(path: Path, bands: Iterable[NDArray[Any]], spec: ImageSpec) -> None:
    target = ImageOutput.create("openexr")
    if target is None:
        raise OutputError(f"this OpenImageIO writes no OpenEXR: {geterror()}")
    with utf8_path(path) as name:
        written, whole = 0, target.open(name, spec)
        for pixels in bands:
            _check_band(pixels, written, spec)
            stop = written + len(pixels)
            whole = whole and target.write_scanlines(written, stop, 0, np.ascontiguousarray(pixels))
            written = stop
            if not whole:
                break
        if whole and written != spec.height:
            target.close()
            raise OutputError(f"expected {spec.height} rows for {path.name}, got {written}")
        closed = target.close()
        trouble = target.geterror()
    if not (whole and closed) or trouble or not _has_last_row(path):
        raise _trouble(path, trouble)


def _check_band(pixels: NDArray[Any], written: int, spec: ImageSpec) -> None:
    if pixels.ndim != 3 or pixels.shape[1:] != (spec.width, spec.nchannels) or written + len(pixels) > spec.height:
        raise OutputError(
            f"expected at most {spec.height - written} more rows of {spec.width} px with {spec.nchannels} channels, got"
            f" shape {pixels.shape}"
        )


def _has_last_row(path: Path) -> bool:
    try:
        with opened(path) as source:
            last = source.spec().height - 1
            checked(path, source, source.read_scanlines(last, last + 1, 0, 0, 1, "float"))
    except LippmannError:
        return False
    return True


def _trouble(path: Path, said: str) -> OutputError:
    """Return the error of OpenImageIO, or that of the system when it is asked for more room."""
    with path.open("ab", buffering=0) as file:
        if file.write(bytes(_PROBE_BYTES)) < _PROBE_BYTES:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    return OutputError(f"cannot write {path.name}: {' '.join(said.split()) or 'it cannot be read back'}")
