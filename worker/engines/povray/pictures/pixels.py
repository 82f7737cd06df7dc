"""The pixels of an EXR and of a PPM of POV-Ray, read with the standard library and NumPy.

A scene may have taken POV-Ray over, so its picture is untrusted. `picture.check_picture` lets one kind of EXR pass:
scan lines, red, green and blue in half floats, ZIP; and one kind of PPM, three times 16 bits. These readers know these
kinds and no other, so that no decoder of many kinds reads what a stranger may have written. Every size comes from the
checked header.

The layout of the EXR is that of "OpenEXR File Layout", https://openexr.com/en/latest/OpenEXRFileLayout.html; the tests
compare every pixel with OpenEXR's own.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from lippmann.lightfield.sheet.assemble import TilePlace
from worker.engines.engine import Region
from worker.engines.povray.pictures.picture import Unlike, exactly, exr_attributes, opened, ppm_size

_MAGIC_AND_VERSION_BYTES = 8
_CHUNK_ROWS = 16
"""The rows that ZIP compresses at once."""
_HALF = np.dtype("<f2")
_CODE = np.dtype(">u2")
_CHANNELS = 3


def read_codes(picture: Path) -> NDArray[np.uint16]:
    """Return the codes of a PPM that `check_picture` let pass, `(rows, cols, 3)`.

    Raises
    ------
    RenderFailed
        If its pixels are cut short.
    """
    with opened(picture) as file:
        rows, cols = ppm_size(file)
        codes = np.fromfile(file, dtype=_CODE)
        if codes.size != rows * cols * _CHANNELS:
            raise Unlike(f"expected {rows} x {cols} px, got {codes.size} codes")
    return codes.astype(np.uint16).reshape(rows, cols, _CHANNELS)


def read_region(picture: Path, place: TilePlace) -> NDArray[np.float16]:
    """Return a region of a picture that `check_picture` let pass, reading no more rows than it has.

    POV-Ray writes a tile as a picture of full size that is black outside; this is its crop.

    Parameters
    ----------
    picture
        An EXR of the whole frame's size.
    place
        The region inside the picture, pixel rows [row_start, row_stop), likewise cols.

    Returns
    -------
    NDArray
        Red, green and blue, linear light, `(rows, cols, 3)`, contiguous.

    Raises
    ------
    RenderFailed
        If its pixels are cut short or damaged.
    """
    region = np.empty((place.row_stop - place.row_start, place.col_stop - place.col_start, _CHANNELS), dtype=_HALF)
    with opened(picture) as file:
        file.seek(_MAGIC_AND_VERSION_BYTES)
        _, _, last_col, last_row = struct.unpack("<4i", dict(exr_attributes(file))["dataWindow"][1])
        rows, cols = last_row + 1, last_col + 1
        chunks = -(-rows // _CHUNK_ROWS)
        offsets = struct.unpack(f"<{chunks}Q", exactly(file, 8 * chunks))
        for index in range(place.row_start // _CHUNK_ROWS, -(-place.row_stop // _CHUNK_ROWS)):
            first = index * _CHUNK_ROWS
            light = _chunk(file, offsets[index], first, min(_CHUNK_ROWS, rows - first), cols)
            start, stop = max(first, place.row_start), min(first + len(light), place.row_stop)
            wanted = light[start - first : stop - first, place.col_start : place.col_stop]
            region[start - place.row_start : stop - place.row_start] = wanted
    return region


def read_bands(picture: Path, first: TilePlace, weights: Sequence[tuple[float, float, float]]) -> NDArray[np.float16]:
    """Return a region of a picture whose wavelength bands are one below the other, as the sum of their shares.

    Parameters
    ----------
    picture
        As for `read_region`.
    first
        The region of the first band.
    weights
        The shares of each band in red, green and blue. A single band is returned as it is.

    Raises
    ------
    RenderFailed
        If its pixels are cut short or damaged.
    """
    if len(weights) == 1:
        return read_region(picture, first)
    rows = first.row_stop - first.row_start
    light = np.zeros((rows, first.col_stop - first.col_start, _CHANNELS), dtype=np.float32)
    for band, shares in enumerate(weights):
        place = Region(first.row_start + band * rows, first.row_stop + band * rows, first.col_start, first.col_stop)
        light += np.array(shares, dtype=np.float32) * read_region(picture, place)
    return light.astype(np.float16)


def _chunk(file: BinaryIO, offset: int, first: int, rows: int, cols: int) -> NDArray[np.float16]:
    """Return the rows of a chunk, `(rows, cols, 3)`."""
    if offset >= os.fstat(file.fileno()).st_size:
        raise Unlike(f"the rows from {first} are at byte {offset}, behind its end")
    file.seek(offset)
    row, packed_bytes = struct.unpack("<2i", exactly(file, 8))
    plain_bytes = rows * cols * _CHANNELS * _HALF.itemsize
    if row != first or not 0 < packed_bytes <= plain_bytes:
        raise Unlike(f"expected at most {plain_bytes} bytes of the rows from {first}, got {packed_bytes} from {row}")
    data = exactly(file, packed_bytes)
    # What does not shrink is stored as it is.
    plain = data if packed_bytes == plain_bytes else _unpacked(data, plain_bytes, first)
    # A row has its channels one after the other, in the order of their names: B, G, R.
    light: NDArray[np.float16] = np.frombuffer(plain, dtype=_HALF).reshape(rows, _CHANNELS, cols)
    return light[:, ::-1].transpose(0, 2, 1)


def _unpacked(data: bytes, plain_bytes: int, first: int) -> NDArray[np.uint8]:
    """Return the bytes that ZIP packed: deflated differences of the even bytes and then of the odd bytes."""
    stream = zlib.decompressobj()
    try:
        found = stream.decompress(data, plain_bytes + 1)
    except zlib.error as error:
        raise Unlike(f"the rows from {first} cannot be inflated: {error}") from error
    if len(found) != plain_bytes or not stream.eof or stream.unused_data:
        raise Unlike(f"the rows from {first} do not inflate to {plain_bytes} bytes")
    # Every difference has 128 added, which is 0 modulo 256 at every other byte.
    sums = np.cumsum(np.frombuffer(found, dtype=np.uint8), dtype=np.uint8)
    sums[1::2] ^= 128
    plain = np.empty_like(sums)
    half = (plain_bytes + 1) // 2
    plain[0::2], plain[1::2] = sums[:half], sums[half:]
    return plain
