"""Pictures that lie: small files whose headers promise more than any reader should believe."""

from __future__ import annotations

import gzip
import io
import struct
import zipfile
import zlib


def png(cols: int, rows: int, *, bits: int = 8, colour: int = 2, chunks: bytes = b"", data: bytes = b"") -> bytes:
    """Return a PNG of any size in its header; without data its pixels are a few zeros."""
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", cols, rows, bits, colour, 0, 0, 0))
    pixels = chunk(b"IDAT", data or zlib.compress(bytes(1000)))
    return b"\x89PNG\r\n\x1a\n" + head + chunks + pixels + chunk(b"IEND", b"")


def chunk(name: bytes, content: bytes) -> bytes:
    """Return a chunk of a PNG."""
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def tiff(tags: dict[int, int], *, start: int = 8) -> bytes:
    """Return a TIFF with a directory of 32-bit numbers, and a few zeros for its strips or tiles."""
    size = {256: 4, 257: 4, 258: 8, 259: 1, 262: 1, 273: 8, 277: 1, 278: 4, 279: 16, 339: 1}
    entries = sorted((size | tags).items())
    table = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in entries)
    return struct.pack("<2sHI", b"II", 42, start) + struct.pack("<H", len(entries)) + table + bytes(4) + bytes(1000)


def exr(
    window: tuple[int, int, int, int] = (0, 0, 3, 3),
    *,
    channels: tuple[bytes, ...] = (b"B", b"G", b"R"),
    tile: tuple[int, int] | None = None,
    claim: int | None = None,
) -> bytes:
    """Return an EXR of any data window (left, top, right, bottom) without pixels.

    `claim` is the size that the channel list is said to have.
    """
    listed = b"".join(name + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for name in channels) + b"\0"
    box = struct.pack("<4i", *window)
    attributes = [
        (b"channels", b"chlist", listed),
        (b"compression", b"compression", b"\0"),
        (b"dataWindow", b"box2i", box),
        (b"displayWindow", b"box2i", box),
        (b"lineOrder", b"lineOrder", b"\0"),
        (b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        (b"screenWindowCenter", b"v2f", bytes(8)),
        (b"screenWindowWidth", b"float", struct.pack("<f", 1)),
        *([(b"tiles", b"tiledesc", struct.pack("<2IB", *tile, 0))] if tile else []),
    ]
    head = b""
    for name, kind, value in attributes:
        size = claim if claim is not None and name == b"channels" else len(value)
        head += name + b"\0" + kind + b"\0" + struct.pack("<i", size) + value
    return b"\x76\x2f\x31\x01" + struct.pack("<I", 0x202 if tile else 2) + head + b"\0" + bytes(64)


def jpeg(cols: int, rows: int, *, channels: int = 3) -> bytes:
    """Return the beginning of a JPEG of any size."""
    listed = b"".join(bytes((number % 256, 0x11, 0)) for number in range(1, channels + 1))
    frame = struct.pack(">BBHBHHB", 0xFF, 0xC0, len(listed) + 8, 8, rows, cols, channels) + listed
    return b"\xff\xd8" + frame + b"\xff\xda\0\x0c\3\1\0\2\0\3\0\0\x3f\0" + bytes(100)


def zipped() -> bytes:
    """Return a zip."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("a.png", png(4, 4))
    return file.getvalue()


BOMBS: dict[str, tuple[bytes, str]] = {
    "PNG 32768 x 32768": (png(32768, 32768), "expected at most 134217728 px, got 32768 x 32768 px"),
    "PNG 2^31 wide": (png(2**31 - 1, 1), "expected at most 32768 px a side, got 1 x 2147483647 px"),
    "PNG of no columns": (png(0, 5), "expected at least 1 px a side, got 5 x 0 px"),
    "PNG without IHDR": (b"\x89PNG\r\n\x1a\n" + chunk(b"IEND", b""), "got no IHDR chunk at its beginning"),
    "PNG with chunks without end": (png(4, 4, chunks=chunk(b"tEXt", b"a\0b") * 2000), "more than 1000 chunks"),
    "PNG cut short": (png(4, 4)[:20], "expected a whole header of a PNG picture, got its beginning alone"),
    "TIFF of 2^32 px a side": (tiff({256: 2**32 - 1, 257: 2**32 - 1}), "expected at most 32768 px a side"),
    "TIFF of huge tiles": (tiff({322: 2**31, 323: 2**31}), "expected at most 2147483648 bytes when decoded"),
    "TIFF of 10,000 channels": (tiff({256: 1, 257: 1, 277: 10_000}), "expected 1 to 256 channels, got 10000"),
    "TIFF of huge numbers": (tiff({256: 30_000, 257: 4000, 258: 2**31}), "bytes when decoded, got"),
    "TIFF without a directory": (tiff({}, start=2**31), "expected a whole header of a TIFF picture"),
    "BigTIFF that begins nowhere": (
        b"II+\0\x08\0\0\0" + struct.pack("<Q", 2**64 - 1),
        "expected a whole header of a TIFF picture, got no directory",
    ),
    "BigTIFF that begins farther than a file system reaches": (
        b"II+\0\x08\0\0\0" + struct.pack("<Q", 2**45),
        "expected a whole header of a TIFF picture, got no directory",
    ),
    "EXR of the largest window": (
        exr((-(2**31), -(2**31), 2**31 - 1, 2**31 - 1)),
        "px a side, got 4294967296 x 4294967296 px",
    ),
    "EXR of a window turned round": (exr((5, 5, 0, 0)), "expected at least 1 px a side, got -4 x -4 px"),
    "EXR of huge tiles": (exr(tile=(2**32 - 1, 2**32 - 1)), "bytes when decoded, got"),
    "EXR of 10,000 channels": (
        exr((0, 0, 0, 0), channels=tuple(b"c%05d" % number for number in range(10_000))),
        "expected 1 to 256 channels, got 10000",
    ),
    "EXR with a list that is too long": (exr(claim=2**31 - 1), "got an attribute 'channels' of 2147483647 bytes"),
    "EXR with a list of negative size": (exr(claim=-1), "got an attribute 'channels' of -1 bytes"),
    "EXR cut short": (exr()[:60], "expected a whole header of a EXR picture"),
    "JPEG 65500 x 65500": (jpeg(65500, 65500), "expected at most 32768 px a side, got 65500 x 65500 px"),
    "JPEG of 255 channels": (jpeg(8000, 16000, channels=255), "bytes when decoded, got"),
    "JPEG of segments without end": (b"\xff\xd8" + b"\xff\xe0\0\x02" * 2000, "more than 1000 segments"),
    "JPEG with a segment of no bytes": (b"\xff\xd8\xff\xc0\0\0" + bytes(40), "got a segment of 0 bytes"),
    "JPEG with a segment of one byte": (b"\xff\xd8\xff\xc0\0\1" + bytes(40), "got a segment of 1 bytes"),
    "PFM that lies": (b"PF\n32768 32768\n-1.0\n", "expected at most 134217728 px, got 32768 x 32768 px"),
    "PFM of many digits": (b"PF\n" + b"9" * 90 + b" 1\n-1\n", "expected a whole header of a PFM picture"),
    "GIF": (b"GIF89a\4\0\4\0" + bytes(20), "expected PNG, TIFF, EXR, JPEG, PFM or PNM, got GIF"),
    "DPX": (b"SDPX" + bytes(2044), "expected PNG, TIFF, EXR, JPEG, PFM or PNM, got DPX"),
    "PSD": (b"8BPS\0\1" + bytes(40), "expected PNG, TIFF, EXR, JPEG, PFM or PNM, got PSD"),
    "zip": (zipped(), "expected PNG, TIFF, EXR, JPEG, PFM or PNM, got a zip"),
    "gzip": (gzip.compress(png(4, 4)), "expected PNG, TIFF, EXR, JPEG, PFM or PNM, got a gzip file"),
    "text": (b"no picture", "got a file that begins with 6e 6f 20 70"),
    "nothing": (b"", "got an empty file"),
}
"""Files that are refused by their header, with a part of the message."""

LIES: dict[str, bytes] = {
    "PNG with few pixels": png(11_000, 11_000),
    "PNG of another size inside": png(40, 40, data=zlib.compress(bytes(10))),
    "TIFF with a strip of 4 GB": tiff({256: 2000, 257: 2000, 278: 2000, 279: 2**32 - 1}),
    "TIFF with a strip outside the file": tiff({256: 2000, 257: 2000, 278: 2000, 273: 2**31}),
    "EXR without pixels": exr((0, 0, 4000, 4000)),
    "EXR with huge offsets": exr()[:-64] + b"\xff" * 64,
    "JPEG without pixels": jpeg(8000, 8000),
    "PFM without pixels": b"PF\n8000 8000\n-1.0\n",
}
"""Files whose headers are within the limits and whose pixels are not there."""
