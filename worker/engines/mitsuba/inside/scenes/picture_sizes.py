"""The pictures that Mitsuba itself decodes, PNG, JPEG, EXR and RGBE: their size by the header, before that."""

from __future__ import annotations

import re
import struct
from pathlib import Path

from worker.engines.mitsuba.inside.scenes.loaded import SceneFiles
from worker.engines.mitsuba.inside.scenes.pictures import check_picture, count_pixels

_EXR_MAGIC = b"\x76\x2f\x31\x01"
_DATA_WINDOW = b"dataWindow\0box2i\0\x10\0\0\0"
_RGBE_SIZE = re.compile(rb"\n[-+]Y (\d{1,9}) [-+]X (\d{1,9})\n")
_HEADER_BYTES = 64 * 1024


def check_picture_file(path: Path, files: SceneFiles, *, place: str) -> None:
    """Check that a file is a picture of a size that a texture may have.

    Raises
    ------
    SceneError
        If it is not.
    """
    with path.open("rb") as file:
        begin = file.read(_HEADER_BYTES)
    if begin.startswith(_EXR_MAGIC):
        at = begin.find(_DATA_WINDOW)
        window = begin[at + len(_DATA_WINDOW) :][:16] if at >= 0 else b""
        if len(window) < 16:
            raise files.refuse(place, "an EXR with a dataWindow in its header", "none")
        left, top, right, bottom = struct.unpack("<4i", window)
        if right < left or bottom < top:
            raise files.refuse(place, "an EXR with a dataWindow that has pixels", (left, top, right, bottom))
        count_pixels(right - left + 1, bottom - top + 1, files, place=place)
    elif begin.startswith(b"#?"):
        size = _RGBE_SIZE.search(begin)
        if size is None:
            raise files.refuse(place, "an RGBE picture with its size", "none")
        count_pixels(int(size[2]), int(size[1]), files, place=place)
    elif begin.startswith((b"\x89PNG", b"\xff\xd8")):
        check_picture(path.read_bytes(), files, place=place)
    else:
        raise files.refuse(place, "a mesh (.obj, .ply) or a picture: PNG, JPEG, EXR or RGBE", repr(begin[:8]))
