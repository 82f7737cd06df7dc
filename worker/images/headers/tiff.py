"""The header of a TIFF, and the orientation in EXIF, which is a TIFF of tags alone.

The tags are those of TIFF 6.0 and its supplements. Directories are chained: each is a page, a reduced copy of one, or a
mask.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from typing import BinaryIO

from worker.images.headers.picture import (
    ENTRIES_AT_MOST,
    PROFILE_BYTES_AT_MOST,
    UPRIGHT,
    DamagedHeader,
    PictureHeader,
    known_orientation,
    read_bytes,
)

PAGES_AT_MOST = 4096
"""The largest number of directories of a file that are looked at."""

_KIND, _COLS, _ROWS, _BITS, _COLOUR, _ORIENTATION, _CHANNELS = 254, 256, 257, 258, 262, 274, 277
_TILE_COLS, _TILE_ROWS, _NUMBERS, _LAYERS, _PROFILE = 322, 323, 339, 32997, 34675
_WHITE_IS_ZERO, _BLACK_IS_ZERO, _PALETTE, _FLOATING = 0, 1, 3, 3
_FOREIGN_COLOURS = {
    4: "a transparency mask",
    5: "CMYK",
    8: "CIE L*a*b*",
    9: "ICC L*a*b*",
    10: "ITU L*a*b*",
    32803: "the mosaic of a sensor's colour filters",
    32844: "CIE Log2(L)",
    32845: "CIE Log2(L) (u', v')",
}
"""The photometric interpretations that are refused."""
_CODES_AT_MOST = 16
"""The bits of the largest codes that are read."""
_TURNED_BY_LIBTIFF = 6
"""YCbCr: libtiff converts it, and turns the picture by its tag in a way of its own."""
_REDUCED, _MASK = 1, 4
_TYPES = {1: "B", 3: "H", 4: "I", 16: "Q"}
_NOWHERE = 1 << 40
"""A place beyond the end of every picture; ext4 takes none from 2^44 on."""


@dataclass(frozen=True)
class _Tags:
    """One directory of a file."""

    file: BinaryIO
    order: str
    is_big: bool
    entries: Mapping[int, tuple[int, int, bytes]]
    """Type, number of values, and values or their place, by tag."""
    following: int
    """The place of the next directory, or 0."""

    def number(self, tag: int, default: int) -> int:
        """Return the first number of a tag."""
        if tag not in self.entries:
            return default
        kind, length, value = self.entries[tag]
        form = _TYPES.get(kind)
        if form is None or not length:
            raise DamagedHeader(f"tag {tag} without a number")
        width = struct.calcsize(f"{self.order}{form}")
        if length * width > len(value):
            self.file.seek(self.offset(value))
            value = read_bytes(self.file, width)
        return int(struct.unpack_from(f"{self.order}{form}", value)[0])

    def offset(self, value: bytes) -> int:
        """Return a place in the file."""
        place = int(struct.unpack(f"{self.order}{'Q' if self.is_big else 'I'}", value)[0])
        if place >= _NOWHERE:
            raise DamagedHeader(f"a place {place} in the file")
        return place

    @property
    def is_page(self) -> bool:
        """True unless the directory is a reduced copy or a mask of another."""
        return not self.number(_KIND, 0) & (_REDUCED | _MASK)


def tiff_header(file: BinaryIO, page: int = 0) -> PictureHeader:
    """Read the header of a page of a TIFF.

    Raises
    ------
    DamagedHeader
        If the file is cut short, makes no sense, or has no such page.
    """
    order, is_big, place = _begin(file)
    pages: list[int] = []
    chosen: _Tags | None = None
    seen: set[int] = set()
    for number in range(PAGES_AT_MOST):
        if number and (place == 0 or place in seen):
            break
        seen.add(place)
        try:
            tags = _directory(file, order, is_big, place)
            is_page = not number or tags.is_page
        except (DamagedHeader, struct.error):
            if len(pages) <= page:
                raise
            break  # the pages before it can be read
        if is_page:
            if len(pages) == page:
                chosen = tags
            pages.append(number)
        place = tags.following
    if chosen is None:
        raise DamagedHeader(f"{len(pages)} pages, without page {page + 1}")
    return _header(chosen, tuple(pages), page)


def exif_orientation(data: bytes) -> int:
    """Return the orientation that EXIF names; 1, upright, if it names none or is damaged."""
    try:
        file = BytesIO(data)
        return known_orientation(_directory(file, *_begin(file)).number(_ORIENTATION, UPRIGHT))
    except (DamagedHeader, struct.error):
        return UPRIGHT


def _begin(file: BinaryIO) -> tuple[str, bool, int]:
    """Return the byte order, whether it is a BigTIFF, and the place of the first directory."""
    file.seek(0)
    begin = read_bytes(file, 8)
    order = "<" if begin[:2] == b"II" else ">"
    is_big = b"+" in begin[2:4]
    if is_big:
        (start,) = struct.unpack(f"{order}Q", read_bytes(file, 8))
    else:
        (start,) = struct.unpack_from(f"{order}I", begin, 4)
    return order, is_big, int(start)


def _directory(file: BinaryIO, order: str, is_big: bool, start: int) -> _Tags:
    if start >= _NOWHERE:
        raise DamagedHeader("no directory")
    file.seek(start)
    count_form, entry_form = (f"{order}Q", f"{order}HHQ8s") if is_big else (f"{order}H", f"{order}HHI4s")
    (count,) = struct.unpack(count_form, read_bytes(file, struct.calcsize(count_form)))
    if count > ENTRIES_AT_MOST:
        raise DamagedHeader(f"a directory of {count} entries")
    table = read_bytes(file, count * struct.calcsize(entry_form))
    entries = {entry[0]: entry[1:] for entry in struct.iter_unpack(entry_form, table)}
    place_form = f"{order}{'Q' if is_big else 'I'}"
    after = file.read(struct.calcsize(place_form))
    # A file that ends with its directory has no other.
    following = struct.unpack(place_form, after)[0] if len(after) == struct.calcsize(place_form) else 0
    return _Tags(file, order, is_big, entries, int(following))


def _header(tags: _Tags, pages: tuple[int, ...], page: int) -> PictureHeader:
    channels, colour = tags.number(_CHANNELS, 1), tags.number(_COLOUR, _BLACK_IS_ZERO)
    if colour == _PALETTE:  # it becomes red, green and blue
        channels = max(channels, 3)
    orientation = known_orientation(tags.number(_ORIENTATION, UPRIGHT))
    if colour == _TURNED_BY_LIBTIFF and orientation != UPRIGHT:
        raise DamagedHeader(f"the orientation tag {orientation} with YCbCr colours; convert the picture to RGB")
    if tags.number(_LAYERS, 1) > 1:
        raise DamagedHeader(f"a volume of {tags.number(_LAYERS, 1)} layers")
    bits, is_light = tags.number(_BITS, 1), tags.number(_NUMBERS, 1) == _FLOATING
    highest = 255 if colour == _PALETTE else 2 ** min(bits, _CODES_AT_MOST) - 1
    icc = None
    if _PROFILE in tags.entries:
        _, length, value = tags.entries[_PROFILE]
        if len(value) < length <= PROFILE_BYTES_AT_MOST:
            tags.file.seek(tags.offset(value))
            icc = tags.file.read(length)
    return PictureHeader(
        "TIFF",
        tags.number(_ROWS, 0),
        tags.number(_COLS, 0),
        channels,
        channels * max(1, math.ceil(bits / 8)),
        is_light,
        icc,
        block_px=tags.number(_TILE_COLS, 0) * tags.number(_TILE_ROWS, 0),
        orientation=orientation,
        pages=pages,
        page=page,
        foreign_colours=_FOREIGN_COLOURS.get(colour, ""),
        highest_code=0 if is_light else highest,
        white_is_zero=colour == _WHITE_IS_ZERO,
    )
