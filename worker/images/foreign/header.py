"""The headers of pictures of other programs, read by content and bounded before a library sees the file.

========= ============================================ ===========================================
format    first bytes                                  read here
========= ============================================ ===========================================
PNG       89 50 4E 47 0D 0A 1A 0A                      the chunks before the pixels
TIFF      II or MM, then 42, or 43 for BigTIFF         the directories
EXR       76 2F 31 01                                  the attributes of the first part
JPEG      FF D8 FF                                     the segments before the pixels
PFM       PF or Pf                                     the three lines
PNM       P5 or P6 (PGM and PPM, binary)               the four numbers
========= ============================================ ===========================================

Everything else is refused by name. Nothing is decoded, and no number of the file decides how much is read.
"""

from __future__ import annotations

import math
import re
import struct
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO

from lippmann.errors import ArtifactBroken, ArtifactMissing
from worker.images.headers.jpeg import jpeg_header
from worker.images.headers.picture import (
    ENTRIES_AT_MOST,
    PROFILE_BYTES_AT_MOST,
    UPRIGHT,
    DamagedHeader,
    PictureHeader,
    read_bytes,
)
from worker.images.headers.tiff import exif_orientation, tiff_header

FORMATS = ("PNG", "TIFF", "EXR", "JPEG", "PFM", "PNM")
"""The formats that are read."""
OWN_PX, OWN_SIDE_PX = 2**32, 2**20
"""The limits of a picture that is read in bands of rows or was made by Lippmann: more than any sheet has."""
CHANNELS_AT_MOST = 256
PIXEL_BYTES_AT_MOST = 16
"""The bytes of a pixel, on average, of the largest picture: four floats. A smaller picture may have more of them."""
_BEGIN_BYTES = 16
_EXR_HEADER_BYTES = 1 << 20
_COLOUR_CHUNKS = (b"cICP", b"sRGB", b"gAMA")
_COLOUR_CHUNK_BYTES = 16
_EXIF_BYTES = 1 << 16
_PNM_HEADER_BYTES = 4096
_HIGHEST_CODE = 65_535
_PNG_CHANNELS = {0: 1, 2: 3, 3: 4, 4: 2, 6: 4}
"""The channels of a PNG by its colour type, decoded: a palette may have transparent colours."""
_EXR_PARTS = 0x10
"""The bit of the second byte of the version that says that there are several parts."""
_PNG_PALETTE = 3
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
    (b"PF", "PFM"),
    (b"Pf", "PFM"),
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
    (b"P5", "PNM"),
    (b"P6", "PNM"),
    *((f"P{number}".encode(), "PNM as text or with bits") for number in (1, 2, 3, 4, 7)),
)


def read_header(
    path: Path, *, page: int = 0, at_most_px: int = OWN_PX, at_most_side_px: int = OWN_SIDE_PX
) -> PictureHeader:
    """Read the header of a picture of any program and check it against the limits.

    Parameters
    ----------
    path
        The file; its suffix counts for nothing.
    page
        The number of the page of a TIFF, from 0.
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
            header = tiff_header(file, page) if name == "TIFF" else _READERS[name](file)
        except (DamagedHeader, struct.error) as error:
            why = str(error) if isinstance(error, DamagedHeader) else "its beginning alone"
            raise ArtifactBroken(f"{path.name}: expected a whole header of a {name} picture, got {why}") from error
    if page >= len(header.pages):
        raise ArtifactBroken(f"{path.name}: expected a page 1 to {len(header.pages)}, got {page + 1}")
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
    if header.foreign_colours:
        raise ArtifactBroken(
            f"{path.name}: expected grey, or red, green and blue, got {header.foreign_colours}; convert it to sRGB"
        )
    needed = max(header.decoded_bytes, header.block_px * header.pixel_bytes)
    if needed > bytes_at_most:
        raise ArtifactBroken(f"{path.name}: expected at most {bytes_at_most} bytes when decoded, got {needed}")


def _png(file: BinaryIO) -> PictureHeader:
    file.seek(8)
    found: dict[bytes, bytes] = {}
    head: tuple[int, int, int, int] | None = None
    icc = None
    orientation = UPRIGHT
    for _ in range(ENTRIES_AT_MOST):
        length, name = struct.unpack(">I4s", read_bytes(file, 8))
        if head is None:
            if name != b"IHDR" or length != 13:
                raise DamagedHeader("no IHDR chunk at its beginning")
            head = struct.unpack(">IIBB", read_bytes(file, 13)[:10])
            file.seek(4, 1)
            continue
        if name == b"IDAT":
            break
        after = file.tell() + length + 4
        if name in _COLOUR_CHUNKS and length <= _COLOUR_CHUNK_BYTES:
            found[name] = read_bytes(file, length)
        elif name == b"iCCP" and length <= PROFILE_BYTES_AT_MOST:
            icc = _png_profile(read_bytes(file, length))
        elif name == b"eXIf" and length <= _EXIF_BYTES:
            orientation = exif_orientation(read_bytes(file, length))
        file.seek(after)
    else:
        raise DamagedHeader(f"more than {ENTRIES_AT_MOST} chunks before the pixels")
    cols, rows, bits, colour = head
    channels = _PNG_CHANNELS.get(colour, 4)
    highest = 255 if colour == _PNG_PALETTE else 2 ** min(bits, 16) - 1
    return PictureHeader(
        "PNG", rows, cols, channels, channels * (2 if bits == 16 else 1), False, icc, found, orientation=orientation,
        highest_code=highest,
    )  # fmt: skip


def _png_profile(chunk: bytes) -> bytes | None:
    """Return the profile of an iCCP chunk (name, zero, method, deflated profile), unpacked up to the limit."""
    packed = chunk.partition(b"\0")[2][1:]
    unpacker = zlib.decompressobj()
    try:
        profile = unpacker.decompress(packed, PROFILE_BYTES_AT_MOST)
    except zlib.error:
        return None
    return profile if unpacker.eof else None


def _exr(file: BinaryIO) -> PictureHeader:
    data = file.read(_EXR_HEADER_BYTES)
    attributes: dict[bytes, bytes] = {}
    texts: dict[str, str] = {}
    at = 8
    for _ in range(ENTRIES_AT_MOST):
        name, at = _text(data, at)
        if not name:
            break
        kind, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        at += 4
        if size < 0 or at + size > len(data):
            raise DamagedHeader(f"an attribute {name.decode('ascii', 'replace')!r} of {size} bytes")
        attributes.setdefault(name, data[at : at + size])
        if kind == b"string":
            texts.setdefault(name.decode(errors="replace"), attributes[name].decode(errors="replace"))
        at += size
    else:
        raise DamagedHeader(f"more than {ENTRIES_AT_MOST} attributes")
    if not {b"dataWindow", b"channels"} <= attributes.keys():
        raise DamagedHeader("no data window or no channels")
    left, top, right, bottom = struct.unpack_from("<4i", attributes[b"dataWindow"])
    numbers = _exr_channels(attributes[b"channels"])
    tiles = attributes.get(b"tiles", bytes(9))
    block_px = math.prod(struct.unpack_from("<2I", tiles))
    rows, cols = bottom - top + 1, right - left + 1
    return PictureHeader(
        "EXR", rows, cols, len(numbers), sum(numbers), True, block_px=block_px, texts=texts,
        has_more_parts=bool(data[5] & _EXR_PARTS),
    )  # fmt: skip


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
        raise DamagedHeader("a name without an end")
    return data[at:end], end + 1


def _pfm(file: BinaryIO) -> PictureHeader:
    found = re.match(rb"(P[Ff])\n(\d{1,9}) (\d{1,9})[ \t]*\n[-+0-9.eE]{1,20}\n", file.read(100))
    if found is None:
        raise DamagedHeader("other lines than its kind, its size and its scale, each ended by a line feed alone")
    channels = 3 if found[1] == b"PF" else 1
    return PictureHeader("PFM", int(found[3]), int(found[2]), channels, 4 * channels, True)


def _pnm(file: BinaryIO) -> PictureHeader:
    space = rb"(?:\s|#[^\n]*\n){1,100}"
    number = space + rb"(\d{1,9})"
    found = re.match(rb"P([56])" + number + number + number + rb"\s(?<!\r(?=\n))", file.read(_PNM_HEADER_BYTES))
    if found is None:
        raise DamagedHeader("other numbers than its size and its highest code, with one white space before the pixels")
    kind, cols, rows, highest = map(int, found.groups())
    if not 1 <= highest <= _HIGHEST_CODE:
        raise DamagedHeader(f"a highest code of {highest}")
    channels = 3 if kind == 6 else 1
    number_bytes = 1 if highest < 256 else 2
    return PictureHeader("PNM", rows, cols, channels, channels * number_bytes, False, highest_code=highest)


_READERS: Mapping[str, Callable[[BinaryIO], PictureHeader]] = {
    "PNG": _png,
    "EXR": _exr,
    "JPEG": jpeg_header,
    "PFM": _pfm,
    "PNM": _pnm,
}
