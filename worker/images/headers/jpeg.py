"""The header of a JPEG (ITU-T T.81, annex B): its size, its colours, and the quality by its tables."""

from __future__ import annotations

import math
import struct
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from worker.images.headers.picture import ENTRIES_AT_MOST, UPRIGHT, DamagedHeader, PictureHeader, read_bytes
from worker.images.headers.tiff import exif_orientation

LUMA_TABLE = np.array(
    (
        *(16, 11, 12, 14, 12, 10, 16, 14, 13, 14, 18, 17, 16, 19, 24, 40),
        *(26, 24, 22, 22, 24, 49, 35, 37, 29, 40, 58, 51, 61, 60, 57, 51),
        *(56, 55, 64, 72, 92, 78, 64, 68, 87, 69, 55, 56, 80, 109, 81, 87),
        *(95, 98, 103, 104, 103, 62, 77, 113, 121, 112, 100, 120, 92, 101, 103, 99),
    )
)
"""The quantisation of luma by ITU-T T.81, table K.1, in zigzag order: that of quality 50."""

_RESTARTS_AND_ENDS = range(0xD0, 0xDA)
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_EXIF, _PROFILE = b"Exif\0\0", b"ICC_PROFILE\0"
_CHROMA = {(1, 1): "4:4:4", (2, 1): "4:2:2", (2, 2): "4:2:0", (4, 1): "4:1:1", (1, 2): "4:4:0"}
"""Chroma subsampling by how much more often luma is sampled (across, down)."""
_INKS = 4


def jpeg_header(file: BinaryIO) -> PictureHeader:
    """Read the segments of a JPEG before its pixels.

    Raises
    ------
    DamagedHeader
        If the file is cut short or makes no sense.
    """
    file.seek(2)
    profile: list[bytes] = []
    tables: dict[int, NDArray[np.int64]] = {}
    orientation = UPRIGHT
    for _ in range(ENTRIES_AT_MOST):
        mark, kind = struct.unpack(">BB", read_bytes(file, 2))
        if mark != 0xFF:
            raise DamagedHeader("no segment where one begins")
        if kind == 0xFF:  # a fill byte
            file.seek(-1, 1)
            continue
        if kind == 0x01 or kind in _RESTARTS_AND_ENDS:
            continue
        (length,) = struct.unpack(">H", read_bytes(file, 2))
        if length < 2:
            raise DamagedHeader(f"a segment of {length} bytes")
        after = file.tell() + length - 2
        if kind in _FRAMES:
            return _header(read_bytes(file, length - 2), b"".join(profile) or None, tables, orientation)
        content = read_bytes(file, length - 2) if kind in (0xDB, 0xE1, 0xE2) and length > 2 else b""
        if content.startswith(_PROFILE):
            profile.append(content[14:])
        elif content.startswith(_EXIF):
            orientation = exif_orientation(content[len(_EXIF) :])
        elif kind == 0xDB:
            tables |= _tables(content)
        file.seek(after)
    raise DamagedHeader(f"more than {ENTRIES_AT_MOST} segments before the pixels")


def jpeg_quality(table: NDArray[np.int64]) -> tuple[int, bool]:
    """Return the quality of a JPEG by its table of luma in zigzag order, and whether the table is that of the quality.

    Qualities are those of the IJG's library: the table of T.81 is multiplied by 50 / quality below 50, and by
    2 - quality / 50 above.

    >>> jpeg_quality(LUMA_TABLE), jpeg_quality(LUMA_TABLE // 2)
    ((50, True), (75, False))
    """
    quality = np.arange(1, 101)
    percent = np.where(quality < 50, 5000 // quality, 200 - 2 * quality)
    made = np.clip((LUMA_TABLE * percent[:, np.newaxis] + 50) // 100, 1, 255)
    off = np.abs(made - np.minimum(table, 255)).sum(axis=1)
    best = int(np.argmin(off))
    return int(quality[best]), bool(off[best] == 0)


def _header(frame: bytes, icc: bytes | None, tables: dict[int, NDArray[np.int64]], orientation: int) -> PictureHeader:
    if len(frame) < 6:
        raise DamagedHeader("its beginning alone")
    bits, rows, cols, channels = struct.unpack_from(">BHHB", frame)
    components = [frame[6 + 3 * place : 9 + 3 * place] for place in range(channels)]
    table = tables.get(components[0][2]) if components and len(components[0]) == 3 else None
    quality, exact = (None, False) if table is None else jpeg_quality(table)
    return PictureHeader(
        "JPEG", rows, cols, channels, channels * math.ceil(bits / 8), False, icc, orientation=orientation,
        foreign_colours="CMYK" if channels == _INKS else "", highest_code=2 ** min(bits, 16) - 1, quality=quality,
        quality_is_exact=exact, chroma=_chroma(components),
    )  # fmt: skip


def _chroma(components: list[bytes]) -> str:
    if len(components) != 3 or any(len(one) < 2 for one in components):
        return ""
    (across, down), *others = ((one[1] >> 4, one[1] & 15) for one in components)
    if len(set(others)) != 1 or 0 in others[0]:
        return ""
    return _CHROMA.get((across // others[0][0], down // others[0][1]), "")


def _tables(content: bytes) -> dict[int, NDArray[np.int64]]:
    """Return the quantisation tables of a segment by their numbers; what is cut short is left out."""
    tables: dict[int, NDArray[np.int64]] = {}
    at = 0
    while at < len(content):
        width, number = 1 + (content[at] >> 4 != 0), content[at] & 15
        values = content[at + 1 : at + 1 + 64 * width]
        if len(values) == 64 * width:
            tables[number] = np.frombuffer(values, dtype=">u2" if width == 2 else np.uint8).astype(np.int64)
        at += 1 + 64 * width
    return tables
