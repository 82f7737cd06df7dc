"""The kinds of pictures that POV-Ray may make, read from its header before anything decodes it.

A scene may have taken POV-Ray over, so its picture is untrusted. It has to be what POV-Ray writes for this command and
nothing else: one kind of pixels, one compression, the size that was asked for. Only such a file is decoded.
"""

from __future__ import annotations

import os
import re
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from lippmann.errors import RenderFailed
from worker.engines.povray.command import RenderCommand

_EXR_MAGIC = b"\x76\x2f\x31\x01"
_EXR_VERSION = b"\x02\x00\x00\x00"
"""Version 2, scan lines, one part, short names."""
_HALF = 1
_ZIP = 3
_MOST_ATTRIBUTES = 32
_MOST_NAME_BYTES = 32
_MOST_VALUE_BYTES = 1024

_PPM = re.compile(rb"P6\n(?:# [ -~]{0,200}\n){0,8}([1-9][0-9]{0,6}) ([1-9][0-9]{0,6})\n65535\n")
"""POV-Ray writes its version, the date and the platform as comments."""
_MOST_PPM_HEADER_BYTES = 2048

_PX_BYTES = 3 * 2
_ROW_BYTES = 64
_HEADER_BYTES = 1024 * 1024


def max_picture_bytes(command: RenderCommand) -> int:
    """Return the largest size of the picture of a command; what does not shrink is stored as it is."""
    return command.rows * (command.cols * _PX_BYTES * 9 // 8 + _ROW_BYTES) + _HEADER_BYTES


def check_picture(picture: Path, command: RenderCommand) -> None:
    """Check that a picture is what POV-Ray writes for a command, without decoding a pixel.

    Raises
    ------
    RenderFailed
        If it is anything else.
    """
    check = {"exr": _check_exr, "ppm16": _check_ppm}[command.picture_format]
    with opened(picture) as file:
        check(file, command)


class Unlike(Exception):
    """A picture is not what POV-Ray writes."""


@contextmanager
def opened(picture: Path) -> Iterator[BinaryIO]:
    """Yield a picture as a file of bytes; `Unlike` becomes a `RenderFailed` that names the picture."""
    with picture.open("rb") as file:
        try:
            yield file
        except Unlike as fault:
            raise RenderFailed(f"POV-Ray ended well and left {picture.name} broken: {fault}.") from fault


def _check_exr(file: BinaryIO, command: RenderCommand) -> None:
    begin = file.read(8)
    if begin != _EXR_MAGIC + _EXR_VERSION:
        raise Unlike(f"it begins with {begin!r}")
    found = dict(exr_attributes(file))
    window = struct.pack("<4i", 0, 0, command.cols - 1, command.rows - 1)
    if found.get("channels") != ("chlist", _channels()):
        raise Unlike("expected the channels R, G and B in half floats")
    if found.get("compression") != ("compression", bytes([_ZIP])):
        raise Unlike("expected the compression ZIP")
    if found.get("lineOrder") != ("lineOrder", b"\0"):
        raise Unlike("expected lines from top to bottom")
    if {found.get("dataWindow"), found.get("displayWindow")} != {("box2i", window)}:
        raise Unlike(f"expected {command.rows} x {command.cols} px")


def exr_attributes(file: BinaryIO) -> Iterator[tuple[str, tuple[str, bytes]]]:
    """Yield the name, the type and the value of every attribute of a header."""
    for _ in range(_MOST_ATTRIBUTES):
        name = _exr_name(file)
        if not name:
            return
        kind = _exr_name(file)
        (size,) = struct.unpack("<I", exactly(file, 4))
        if size > _MOST_VALUE_BYTES:
            raise Unlike(f"an attribute of {size} bytes")
        yield name, (kind, exactly(file, size))
    raise Unlike(f"more than {_MOST_ATTRIBUTES} attributes")


def _exr_name(file: BinaryIO) -> str:
    name = bytearray()
    while (byte := exactly(file, 1)) != b"\0":
        name += byte
        if len(name) > _MOST_NAME_BYTES:
            raise Unlike("a name without end")
    return name.decode("ascii", errors="replace")


def _channels() -> bytes:
    return b"".join(name + b"\0" + struct.pack("<iB3xii", _HALF, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"


def _check_ppm(file: BinaryIO, command: RenderCommand) -> None:
    rows, cols = ppm_size(file)
    if (rows, cols) != (command.rows, command.cols):
        raise Unlike(f"expected {command.rows} x {command.cols} px, got {rows} x {cols} px")
    expected = rows * cols * _PX_BYTES
    if (size := os.fstat(file.fileno()).st_size - file.tell()) != expected:
        raise Unlike(f"expected {expected} bytes of pixels, got {size}")


def ppm_size(file: BinaryIO) -> tuple[int, int]:
    """Return the rows and columns of a PPM of three times 16 bits; the file is then at its pixels."""
    begin = file.read(_MOST_PPM_HEADER_BYTES)
    header = _PPM.match(begin)
    if header is None:
        raise Unlike(f"it begins with {begin[:32]!r}")
    file.seek(header.end())
    return int(header[2]), int(header[1])


def exactly(file: BinaryIO, size: int) -> bytes:
    """Return the next bytes of a file, all of them."""
    data = file.read(size)
    if len(data) != size:
        raise Unlike("it is cut short")
    return data
