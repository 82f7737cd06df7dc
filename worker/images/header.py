"""The headers of pictures of other programs, read by content and bounded before a library sees the file.

========= ============================================ ===========================================
format    first bytes                                  read here
========= ============================================ ===========================================
PNG       89 50 4E 47 0D 0A 1A 0A                      the chunks before the pixels
TIFF      II or MM, then 42, or 43 for BigTIFF         the first directory
EXR       76 2F 31 01                                  the attributes of the first part
JPEG      FF D8 FF                                     the segments before the pixels
PFM       PF or Pf                                     the three lines
========= ============================================ ===========================================

Everything else is refused by name. Nothing is decoded, and no number of the file decides how much is read.
"""

from __future__ import annotations

import math
import re
import struct
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from lippmann.errors import ArtifactBroken, ArtifactMissing

FORMATS = ("PNG", "TIFF", "EXR", "JPEG", "PFM")
"""The formats that are read."""
OWN_PX, OWN_SIDE_PX = 2**32, 2**20
"""The limits of a picture that is read in bands of rows or was made by Lippmann: more than any sheet has."""
CHANNELS_AT_MOST = 256
PIXEL_BYTES_AT_MOST = 16
"""The bytes of a pixel, on average, of the largest picture: four floats. A smaller picture may have more of them."""
PROFILE_BYTES_AT_MOST = 4 << 20
"""The largest ICC profile that is read; a larger one counts as none."""

_BEGIN_BYTES = 16
_ENTRIES_AT_MOST = 1000
"""The largest number of chunks, segments, attributes or tags that are looked at."""
_EXR_HEADER_BYTES = 1 << 20
_COLOUR_CHUNKS = (b"cICP", b"sRGB", b"gAMA")
_COLOUR_CHUNK_BYTES = 16
_PNG_CHANNELS = {0: 1, 2: 3, 3: 4, 4: 2, 6: 4}
"""The channels of a PNG by its colour type, decoded: a palette may have transparent colours."""
_TIFF_TYPES = {1: "B", 3: "H", 4: "I", 16: "Q"}
_EXR_BYTES = {0: 4, 1: 2, 2: 4}
"""The bytes of a number by the type of an EXR channel: uint, half, float."""

_SIGNATURES: tuple[tuple[bytes, str], ...] = (
    (b"\x89PNG\r\n\x1a\n", "PNG"),
    (b"II*\0", "TIFF"),
    (b"MM\0*", "TIFF"),
    (b"II+\0", "TIFF"),
    (b"MM\0+", "TIFF"),
    (b"\x76\x2f\x31\x01", "EXR"),
    (b"\xff\xd8\xff", "JPEG"),
    (b"PF\n", "PFM"),
    (b"Pf\n", "PFM"),
    (b"GIF8", "GIF"),
    (b"8BPS", "PSD"),
    (b"SDPX", "DPX"),
    (b"XPDS", "DPX"),
    (b"BM", "BMP"),
    (b"DDS ", "DDS"),
    (b"#?RADIANCE", "Radiance HDR"),
    (b"SIMPLE  =", "FITS"),
    (b"\xff\x0a", "JPEG XL"),
    (b"\0\0\0\x0cJXL ", "JPEG XL"),
    (b"\0\0\0\x0cjP  ", "JPEG 2000"),
    (b"RIFF", "WebP or another RIFF file"),
    (b"PK\x03\x04", "a zip"),
    (b"\x1f\x8b", "a gzip file"),
    (b"BZh", "a bzip2 file"),
    (b"\xfd7zXZ\0", "an xz file"),
    (b"%PDF", "PDF"),
    (b"%!PS", "PostScript"),
    (b"<", "XML"),
    *((f"P{number}".encode(), "PNM") for number in range(1, 8)),
)


class _Damaged(Exception):
    """The header is cut short or makes no sense; the text continues "expected a whole header of a PNG, got"."""


@dataclass(frozen=True)
class PictureHeader:
    """What the header of a picture says, within the limits."""

    format: str
    rows: int
    cols: int
    channels: int
    pixel_bytes: int
    """The bytes of a pixel in memory, all channels."""
    is_light: bool
    """True if the numbers are floating ones."""
    icc: bytes | None = field(default=None, repr=False)
    """The ICC profile."""
    chunks: Mapping[bytes, bytes] = field(default_factory=dict, repr=False)
    """The chunks of a PNG that name its colour space."""
    block_px: int = 0
    """The pixels of the largest block that a reader must hold at once, such as a tile; 0 if the file names none."""
    texts: Mapping[str, str] = field(default_factory=dict, repr=False)
    """The attributes of an EXR that are texts."""

    @property
    def decoded_bytes(self) -> int:
        """The bytes of all pixels in memory."""
        return self.rows * self.cols * self.pixel_bytes


def read_header(path: Path, *, at_most_px: int = OWN_PX, at_most_side_px: int = OWN_SIDE_PX) -> PictureHeader:
    """Read the header of a picture of any program and check it against the limits.

    Parameters
    ----------
    path
        The file; its suffix counts for nothing.
    at_most_px, at_most_side_px
        The limits of rows x columns, and of each of them.

    Raises
    ------
    ArtifactMissing
        If there is no such file.
    ArtifactBroken
        If its format is not one of `FORMATS`, its header is damaged, or the picture is larger than the limits.
    """
    if not path.is_file():
        raise ArtifactMissing(f"expected a picture at {path.name}, got no file")
    with path.open("rb") as file:
        name = format_of(file.read(_BEGIN_BYTES))
        if name not in FORMATS:
            raise ArtifactBroken(f"{path.name}: expected {', '.join(FORMATS[:-1])} or {FORMATS[-1]}, got {name}")
        file.seek(0)
        try:
            header = _READERS[name](file)
        except (_Damaged, struct.error) as error:
            why = str(error) if isinstance(error, _Damaged) else "its beginning alone"
            raise ArtifactBroken(f"{path.name}: expected a whole header of a {name} picture, got {why}") from error
    _check(path, header, at_most_px, at_most_side_px)
    return header


def format_of(begin: bytes) -> str:
    """Return the format of a file by its first bytes, or a description for a message.

    >>> format_of(b"GIF89a"), format_of(b"")
    ('GIF', 'an empty file')
    """
    for signature, name in _SIGNATURES:
        if begin.startswith(signature):
            return name
    return f"a file that begins with {begin[:8].hex(' ')}" if begin else "an empty file"


def _check(path: Path, header: PictureHeader, at_most_px: int, at_most_side_px: int) -> None:
    rows, cols = header.rows, header.cols
    size, bytes_at_most = f"{rows} x {cols} px", at_most_px * PIXEL_BYTES_AT_MOST
    if min(rows, cols) < 1:
        raise ArtifactBroken(f"{path.name}: expected at least 1 px a side, got {size}")
    if max(rows, cols) > at_most_side_px:
        raise ArtifactBroken(f"{path.name}: expected at most {at_most_side_px} px a side, got {size}")
    if rows * cols > at_most_px:
        raise ArtifactBroken(f"{path.name}: expected at most {at_most_px} px, got {size}, which is {rows * cols}")
    if not 1 <= header.channels <= CHANNELS_AT_MOST:
        raise ArtifactBroken(f"{path.name}: expected 1 to {CHANNELS_AT_MOST} channels, got {header.channels}")
    needed = max(header.decoded_bytes, header.block_px * header.pixel_bytes)
    if needed > bytes_at_most:
        raise ArtifactBroken(f"{path.name}: expected at most {bytes_at_most} bytes when decoded, got {needed}")


def _read(file: BinaryIO, count: int) -> bytes:
    data = file.read(count)
    if len(data) < count:
        raise _Damaged("its beginning alone")
    return data


def _png(file: BinaryIO) -> PictureHeader:
    file.seek(8)
    found: dict[bytes, bytes] = {}
    head: tuple[int, int, int, int] | None = None
    icc = None
    for _ in range(_ENTRIES_AT_MOST):
        length, name = struct.unpack(">I4s", _read(file, 8))
        if head is None:
            if name != b"IHDR" or length != 13:
                raise _Damaged("no IHDR chunk at its beginning")
            head = struct.unpack(">IIBB", _read(file, 13)[:10])
            file.seek(4, 1)
            continue
        if name == b"IDAT":
            break
        after = file.tell() + length + 4
        if name in _COLOUR_CHUNKS and length <= _COLOUR_CHUNK_BYTES:
            found[name] = _read(file, length)
        elif name == b"iCCP" and length <= PROFILE_BYTES_AT_MOST:
            icc = _png_profile(_read(file, length))
        file.seek(after)
    else:
        raise _Damaged(f"more than {_ENTRIES_AT_MOST} chunks before the pixels")
    cols, rows, bits, colour = head
    channels = _PNG_CHANNELS.get(colour, 4)
    return PictureHeader("PNG", rows, cols, channels, channels * (2 if bits == 16 else 1), False, icc, found)


def _png_profile(chunk: bytes) -> bytes | None:
    """Return the profile of an iCCP chunk (name, zero, method, deflated profile), unpacked up to the limit."""
    packed = chunk.partition(b"\0")[2][1:]
    unpacker = zlib.decompressobj()
    try:
        profile = unpacker.decompress(packed, PROFILE_BYTES_AT_MOST)
    except zlib.error:
        return None
    return profile if unpacker.eof else None


def _tiff(file: BinaryIO) -> PictureHeader:
    begin = _read(file, 16)
    order = "<" if begin[:2] == b"II" else ">"
    is_big = b"+" in begin[2:4]
    start, count_format, entry_format = (
        (struct.unpack_from(f"{order}Q", begin, 8)[0], "Q", "HHQ8s")
        if is_big
        else (struct.unpack_from(f"{order}I", begin, 4)[0], "H", "HHI4s")
    )
    if start >= 1 << 62:
        raise _Damaged("no directory")
    file.seek(start)
    (count,) = struct.unpack(f"{order}{count_format}", _read(file, struct.calcsize(f"{order}{count_format}")))
    if count > _ENTRIES_AT_MOST:
        raise _Damaged(f"a directory of {count} entries")
    size = struct.calcsize(f"{order}{entry_format}")
    table = _read(file, count * size)
    tags = {entry[0]: entry[1:] for entry in struct.iter_unpack(f"{order}{entry_format}", table)}

    def number(tag: int, default: int) -> int:
        """Return the first number of a tag."""
        if tag not in tags:
            return default
        kind, length, value = tags[tag]
        form = _TIFF_TYPES.get(kind)
        if form is None or not length:
            raise _Damaged(f"tag {tag} without a number")
        width = struct.calcsize(f"{order}{form}")
        if length * width > len(value):
            file.seek(offset(value))
            value = _read(file, width)
        return int(struct.unpack_from(f"{order}{form}", value)[0])

    def offset(value: bytes) -> int:
        place = int(struct.unpack(f"{order}{'Q' if is_big else 'I'}", value)[0])
        return place if place < 1 << 62 else _no_place(place)

    cols, rows, channels = number(256, 0), number(257, 0), number(277, 1)
    if number(262, 0) == 3:  # a palette becomes red, green and blue
        channels = max(channels, 3)
    bits = number(258, 1)
    block_px = number(322, 0) * number(323, 0)
    icc = None
    if 34675 in tags and len(tags[34675][2]) < tags[34675][1] <= PROFILE_BYTES_AT_MOST:
        file.seek(offset(tags[34675][2]))
        icc = file.read(tags[34675][1])
    pixel_bytes = channels * max(1, math.ceil(bits / 8))
    return PictureHeader("TIFF", rows, cols, channels, pixel_bytes, number(339, 1) == 3, icc, block_px=block_px)


def _no_place(place: int) -> int:
    raise _Damaged(f"a place {place} in the file")


def _exr(file: BinaryIO) -> PictureHeader:
    data = file.read(_EXR_HEADER_BYTES)
    attributes: dict[bytes, bytes] = {}
    texts: dict[str, str] = {}
    at = 8
    for _ in range(_ENTRIES_AT_MOST):
        name, at = _text(data, at)
        if not name:
            break
        kind, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        at += 4
        if size < 0 or at + size > len(data):
            raise _Damaged(f"an attribute {name.decode('ascii', 'replace')!r} of {size} bytes")
        attributes.setdefault(name, data[at : at + size])
        if kind == b"string":
            texts.setdefault(name.decode(errors="replace"), attributes[name].decode(errors="replace"))
        at += size
    else:
        raise _Damaged(f"more than {_ENTRIES_AT_MOST} attributes")
    if not {b"dataWindow", b"channels"} <= attributes.keys():
        raise _Damaged("no data window or no channels")
    left, top, right, bottom = struct.unpack_from("<4i", attributes[b"dataWindow"])
    numbers = _exr_channels(attributes[b"channels"])
    tiles = attributes.get(b"tiles", bytes(9))
    block_px = math.prod(struct.unpack_from("<2I", tiles))
    rows, cols = bottom - top + 1, right - left + 1
    return PictureHeader("EXR", rows, cols, len(numbers), sum(numbers), True, block_px=block_px, texts=texts)


def _exr_channels(data: bytes) -> list[int]:
    """Return the bytes of a number of every channel of a channel list."""
    found: list[int] = []
    at = 0
    while True:
        name, at = _text(data, at)
        if not name:
            return found
        (kind,) = struct.unpack_from("<i", data, at)
        found.append(_EXR_BYTES.get(kind, 4))
        at += 16


def _text(data: bytes, at: int) -> tuple[bytes, int]:
    end = data.find(b"\0", at, at + 256)
    if end < 0:
        raise _Damaged("a name without an end")
    return data[at:end], end + 1


def _jpeg(file: BinaryIO) -> PictureHeader:
    file.seek(2)
    profile: list[bytes] = []
    for _ in range(_ENTRIES_AT_MOST):
        mark, kind = struct.unpack(">BB", _read(file, 2))
        if mark != 0xFF:
            raise _Damaged("no segment where one begins")
        if kind == 0xFF:  # a fill byte
            file.seek(-1, 1)
            continue
        if kind == 0x01 or 0xD0 <= kind <= 0xD9:
            continue
        (length,) = struct.unpack(">H", _read(file, 2))
        after = file.tell() + length - 2
        if 0xC0 <= kind <= 0xCF and kind not in (0xC4, 0xC8, 0xCC):
            bits, rows, cols, channels = struct.unpack(">BHHB", _read(file, 6))
            icc = b"".join(profile) or None
            return PictureHeader("JPEG", rows, cols, channels, channels * math.ceil(bits / 8), False, icc)
        if kind == 0xE2 and length > 16:
            content = _read(file, length - 2)
            if content.startswith(b"ICC_PROFILE\0"):
                profile.append(content[14:])
        file.seek(after)
    raise _Damaged(f"more than {_ENTRIES_AT_MOST} segments before the pixels")


def _pfm(file: BinaryIO) -> PictureHeader:
    found = re.match(rb"(P[Ff])\n(\d{1,9}) (\d{1,9})\s*\n[-+0-9.eE]{1,20}\s*\n", file.read(100))
    if found is None:
        raise _Damaged("other lines than its kind, its size and its scale")
    channels = 3 if found[1] == b"PF" else 1
    return PictureHeader("PFM", int(found[3]), int(found[2]), channels, 4 * channels, True)


_READERS: Mapping[str, Callable[[BinaryIO], PictureHeader]] = {
    "PNG": _png,
    "TIFF": _tiff,
    "EXR": _exr,
    "JPEG": _jpeg,
    "PFM": _pfm,
}
