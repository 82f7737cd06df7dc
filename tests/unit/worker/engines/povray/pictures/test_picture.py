"""Only what POV-Ray writes for a command passes for its picture."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from lippmann.errors import RenderFailed
from worker.engines.povray.command import PictureFormat, RenderCommand
from worker.engines.povray.pictures.picture import check_picture, max_picture_bytes

CHANNELS = b"".join(name + struct.pack("<iB3xii", 1, 0, 1, 1) for name in (b"B\0", b"G\0", b"R\0")) + b"\0"


def command(picture_format: PictureFormat) -> RenderCommand:
    return RenderCommand("a.pov", f"picture.{picture_format}", cols=64, rows=48, picture_format=picture_format)


def exr(*, version: bytes = b"\x02\0\0\0", count: int = 0, **changed: bytes) -> bytes:
    window = struct.pack("<4i", 0, 0, 63, 47)
    values = {"channels": CHANNELS, "compression": b"\3", "dataWindow": window, "displayWindow": window}
    values |= {"lineOrder": b"\0"} | {f"more{number}": b"" for number in range(count)} | changed
    kinds = {"channels": b"chlist", "dataWindow": b"box2i", "displayWindow": b"box2i"}
    text = b"\x76\x2f\x31\x01" + version
    for name, value in values.items():
        text += name.encode() + b"\0" + kinds.get(name, name.encode()) + b"\0" + struct.pack("<I", len(value)) + value
    return text + b"\0"


def ppm(*, cols: int = 64, rows: int = 48, most: int = 65535, pixels: int = 64 * 48 * 6) -> bytes:
    return f"P6\n{cols} {rows}\n{most}\n".encode() + bytes(pixels)


def _check(folder: Path, picture_format: PictureFormat, data: bytes) -> None:
    path = folder / "picture"
    path.write_bytes(data)
    check_picture(path, command(picture_format))


def test_what_povray_writes_passes(tmp_path: Path) -> None:
    _check(tmp_path, "exr", exr())
    _check(tmp_path, "ppm16", ppm())
    _check(tmp_path, "ppm16", ppm().replace(b"\n", b"\n# Software: POV-Ray 3.7\n# Compiler: g++\n", 1))


HOSTILE: dict[str, tuple[PictureFormat, Callable[[], bytes]]] = {
    "nothing": ("exr", bytes),
    "another format": ("exr", ppm),
    "a huge window": ("exr", lambda: exr(dataWindow=struct.pack("<4i", 0, 0, 2**30, 2**30))),
    "a window at another place": ("exr", lambda: exr(dataWindow=struct.pack("<4i", 1, 0, 64, 47))),
    "tiles": ("exr", lambda: exr(version=b"\x02\x02\0\0")),
    "many parts": ("exr", lambda: exr(version=b"\x02\x10\0\0")),
    "another compression": ("exr", lambda: exr(compression=b"\4")),
    "more channels": ("exr", lambda: exr(channels=CHANNELS[:-1] + b"Z\0" + CHANNELS[2:18] + b"\0")),
    "subsampled channels": ("exr", lambda: exr(channels=CHANNELS.replace(b"\1\0\0\0\1\0\0\0", b"\1\0\0\0\0\0\0\0", 1))),
    "too many attributes": ("exr", lambda: exr(count=100)),
    "a large attribute": ("exr", lambda: exr(comments=bytes(5000))),
    "a header cut short": ("exr", lambda: exr()[:-20]),
    "a name without end": ("exr", lambda: exr()[:8] + b"a" * 5000),
    "a large PPM": ("ppm16", lambda: ppm(cols=2**31 - 1)),
    "a PPM turned": ("ppm16", lambda: ppm(cols=48, rows=64)),
    "a PPM of 8 bits": ("ppm16", lambda: ppm(most=255)),
    "a PPM with a long comment": ("ppm16", lambda: ppm().replace(b"\n", b"\n# " + b"x" * 5000 + b"\n", 1)),
    "a PPM with many comments": ("ppm16", lambda: ppm().replace(b"\n", b"\n" + b"# x\n" * 100, 1)),
    "a PPM cut short": ("ppm16", lambda: ppm(pixels=64 * 48 * 6 - 1)),
    "a PPM with more behind it": ("ppm16", lambda: ppm(pixels=64 * 48 * 6 + 1)),
    "a PNG in the place of a PPM": ("ppm16", lambda: b"\x89PNG\r\n\x1a\n" + bytes(100)),
    "an EXR in the place of a PPM": ("ppm16", exr),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_anything_else_is_refused_before_it_is_decoded(tmp_path: Path, name: str) -> None:
    picture_format, make = HOSTILE[name]
    with pytest.raises(RenderFailed, match="POV-Ray ended well and left picture"):
        _check(tmp_path, picture_format, make())


@pytest.mark.parametrize("picture_format", ["exr", "ppm16"])
def test_the_size_has_room_for_pixels_that_do_not_shrink(picture_format: PictureFormat) -> None:
    assert max_picture_bytes(command(picture_format)) > 64 * 48 * 6 + 48 * 12
