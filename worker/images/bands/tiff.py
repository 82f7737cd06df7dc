"""TIFF by bands of rows: a print of any size goes to disk as it is made.

tifffile writes the file: an ICC profile, the density as a fraction, so that a printer's pitch is exact, and
BigTIFF where 4 GiB are not enough. It accepts single strips only if they are compressed already, so this module
compresses them.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator
from fractions import Fraction
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import OutputError
from worker.images.density import Density
from worker.images.icc import srgb_profile

STRIP_ROWS = 64
CLASSIC_BYTES = 2**32 - 2**26
"""The bytes of codes that fit in a TIFF: 4 GiB, less 64 MiB for the directory and for what deflate may add."""
_LEVEL = 4
_LARGEST = 2**32 - 1
"""The largest number in a fraction of a TIFF."""


def write_tiff_bands(
    file: BinaryIO,
    bands: Iterable[NDArray[Any]],
    *,
    rows: int,
    cols: int,
    bits: int,
    density: Density | None = None,
) -> None:
    """Write sRGB codes as a TIFF, deflated. The same codes give the same bytes, however they are cut.

    Parameters
    ----------
    file
        An empty file that can seek.
    bands
        The bands from the top: `(some rows, cols, 3)`, uint8 or uint16, with `rows` rows in all.
    rows, cols
        The size of the picture, px.
    bits
        8 or 16.
    density
        The density, stored in pixels per inch.

    Raises
    ------
    OutputError
        If the bands are not of this picture.

    Notes
    -----
    With more than `CLASSIC_BYTES` of codes it is a BigTIFF: how long the deflated strips will be is not known before.
    """
    from tifffile import TiffWriter  # a tenth of a second, and only files for printers need it

    packed = (zlib.compress(_predicted(strip), _LEVEL) for strip in _strips(_checked(bands, rows, cols, bits)))
    with TiffWriter(file, bigtiff=rows * cols * 3 * bits // 8 > CLASSIC_BYTES, byteorder="<") as writer:
        writer.write(
            packed,
            shape=(rows, cols, 3),
            dtype=f"uint{bits}",
            photometric="rgb",
            rowsperstrip=STRIP_ROWS,
            compression="zlib",
            predictor="horizontal",
            resolution=None if density is None else (_fraction(density.across), _fraction(density.down)),
            resolutionunit=None if density is None else "inch",
            iccprofile=srgb_profile(),
            metadata=None,
            software=False,
        )
    next(packed, None)  # raises if rows are left


def _checked(bands: Iterable[NDArray[Any]], rows: int, cols: int, bits: int) -> Iterator[NDArray[Any]]:
    """Yield the bands, and check that they are the rows of this picture."""
    done = 0
    for band in bands:
        if band.shape[1:] != (cols, 3) or band.dtype != f"uint{bits}":
            raise OutputError(f"expected rows of {cols} px of {bits} bits, got {band.dtype} {band.shape}")
        done += len(band)
        if done > rows:
            raise OutputError(f"expected {rows} rows of pixels, got {done} or more")
        yield band
    if done != rows:
        raise OutputError(f"expected {rows} rows of pixels, got {done}")


def _strips(bands: Iterable[NDArray[Any]]) -> Iterator[NDArray[Any]]:
    """Yield bands as strips of `STRIP_ROWS` rows; the last strip has the rest."""
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
    """Return every pixel minus the pixel to its left, modulo the range of codes, little-endian."""
    difference = strip.copy()
    difference[:, 1:] -= strip[:, :-1]
    return difference.astype(difference.dtype.newbyteorder("<"), copy=False).tobytes()


def _fraction(number: float) -> tuple[int, int]:
    """Return numerator and denominator; the denominator is small enough that both fit in 32 bits."""
    fraction = Fraction(number).limit_denominator(max(1, min(1_000_000, int(_LARGEST / max(number, 1.0)))))
    return fraction.numerator, fraction.denominator
