"""TIFF by bands of rows: a print of any size goes to disk as it is made.

Baseline TIFF 6.0 with deflated strips and horizontal predictor, an ICC profile, and the density as a fraction, so that
a printer's pitch is said exactly. OpenImageIO's writer needs the whole file in memory to be trusted (`encode`), and
adds blocks of Exif and XMP that no print needs.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable
from fractions import Fraction
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from worker.errors import OutputError
from worker.images.density import Density
from worker.images.icc import srgb_profile

STRIP_ROWS = 64
_LEVEL = 4
_MAX_BYTES = 2**32 - 1
_SHORT, _LONG, _RATIONAL, _UNDEFINED = 3, 4, 5, 7
_PACKED_AS = {_SHORT: "H", _LONG: "I", _RATIONAL: "I", _UNDEFINED: "B"}


def write_tiff_bands(
    file: BinaryIO,
    bands: Iterable[NDArray[Any]],
    *,
    rows: int,
    cols: int,
    bits: int,
    density: Density | None = None,
) -> None:
    """Write sRGB codes as a TIFF.

    Parameters
    ----------
    file
        Empty, can seek.
    bands
        From the top: `(some rows, cols, 3)`, uint8 or uint16, `rows` in all.
    rows, cols
        Of the picture, px.
    bits
        8 or 16.
    density
        Said in pixels an inch.

    Raises
    ------
    OutputError
        If the bands are not of this picture, or the file would be longer than 4 GiB, which TIFF cannot say.
    """
    file.write(struct.pack("<2sHI", b"II", 42, 0))
    offsets, sizes, done = [], [], 0
    for strip in _strips(bands):
        if strip.shape[1:] != (cols, 3) or strip.dtype != f"uint{bits}":
            raise OutputError(f"expected rows of {cols} px of {bits} bits, got {strip.dtype} {strip.shape}")
        deflated = zlib.compress(_predicted(strip), _LEVEL)
        offsets.append(file.tell())
        sizes.append(len(deflated))
        if offsets[-1] + len(deflated) > _MAX_BYTES:
            raise OutputError(f"expected a TIFF of at most 4 GiB, got more for {rows} x {cols} px of {bits} bits")
        file.write(deflated)
        done += len(strip)
    if done != rows:
        raise OutputError(f"expected {rows} rows of pixels, got {done}")
    _write_directory(file, _tags(rows, cols, bits, offsets, sizes, density))


def _strips(bands: Iterable[NDArray[Any]]) -> Iterable[NDArray[Any]]:
    """Yield bands as strips of `STRIP_ROWS` rows, the last with what is left."""
    kept: NDArray[Any] | None = None
    for band in bands:
        kept = band if kept is None or not len(kept) else np.concatenate((kept, band))
        whole = len(kept) - len(kept) % STRIP_ROWS
        for top in range(0, whole, STRIP_ROWS):
            yield kept[top : top + STRIP_ROWS]
        kept = kept[whole:]
    if kept is not None and len(kept):
        yield kept


def _predicted(strip: NDArray[Any]) -> bytes:
    """Return every pixel less the one to its left, modulo the range of codes, little-endian."""
    difference = strip.copy()
    difference[:, 1:] -= strip[:, :-1]
    return difference.astype(difference.dtype.newbyteorder("<"), copy=False).tobytes()


def _tags(
    rows: int, cols: int, bits: int, offsets: list[int], sizes: list[int], density: Density | None
) -> list[tuple[int, int, list[int]]]:
    """Return (tag, type, values) in rising order of tags."""
    tags = [
        (256, _LONG, [cols]),
        (257, _LONG, [rows]),
        (258, _SHORT, [bits] * 3),
        (259, _SHORT, [8]),  # deflate
        (262, _SHORT, [2]),  # RGB
        (273, _LONG, offsets),
        (274, _SHORT, [1]),  # row 0 at the top, col 0 at the left
        (277, _SHORT, [3]),
        (278, _LONG, [STRIP_ROWS]),
        (279, _LONG, sizes),
        (284, _SHORT, [1]),  # red, green and blue of a pixel together
        (317, _SHORT, [2]),  # horizontal predictor
        (34675, _UNDEFINED, list(srgb_profile())),
    ]
    if density is not None:
        tags += [
            (282, _RATIONAL, _fraction(density.across)),
            (283, _RATIONAL, _fraction(density.down)),
            (296, _SHORT, [2]),  # inch
        ]
    return sorted(tags)


def _fraction(number: float) -> list[int]:
    """Return numerator and denominator; the denominator is small enough that both fit in 32 bits."""
    fraction = Fraction(number).limit_denominator(max(1, min(1_000_000, int(_MAX_BYTES / max(number, 1.0)))))
    return [fraction.numerator, fraction.denominator]


def _write_directory(file: BinaryIO, tags: list[tuple[int, int, list[int]]]) -> None:
    """Write the directory at the end, longer values behind it, and where it is at the beginning."""
    start = file.tell() + file.tell() % 2
    entries, behind = b"", b""
    values_at = start + 2 + 12 * len(tags) + 4
    for tag, kind, values in tags:
        count = len(values) // 2 if kind == _RATIONAL else len(values)
        data = struct.pack(f"<{len(values)}{_PACKED_AS[kind]}", *values)
        if len(data) > 4:
            place, data = struct.pack("<I", values_at + len(behind)), data + b"\0" * (len(data) % 2)
            behind, data = behind + data, place
        entries += struct.pack("<HHI4s", tag, kind, count, data)
    file.write(b"\0" * (start - file.tell()) + struct.pack("<H", len(tags)) + entries + b"\0\0\0\0" + behind)
    file.seek(4)
    file.write(struct.pack("<I", start))
