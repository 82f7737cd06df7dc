"""What a .ply or .obj announces, compared with its size before a library reads it."""

from __future__ import annotations

import re
from pathlib import Path

from worker.engines.mitsuba.inside.scenes.loaded import MAX_SHAPES, SceneFiles

_HEADER_BYTES = 64 * 1024
_ELEMENT = re.compile(rb"^element[ \t]+(\S+)[ \t]+(\S+)[ \t]*\r?$", re.MULTILINE)


def check_mesh_file(path: Path, files: SceneFiles, *, name: str, place: str) -> None:
    """Check what a .ply or .obj announces against its size, and that the places of an .obj are numbers."""
    if path.suffix.lower() == ".ply":
        _check_ply(path, files, name=name, place=place)
    else:
        _check_obj(path.read_bytes(), files, place=f"{place}: {name}" if place != name else place)


def _check_ply(path: Path, files: SceneFiles, *, name: str, place: str) -> None:
    with path.open("rb") as file:
        begin = file.read(_HEADER_BYTES)
    head, end, _ = begin.partition(b"end_header")
    where = f"{place}: {name}" if place != name else place
    if not begin.startswith(b"ply") or not end:
        raise files.refuse(where, f"a .ply whose header ends within {_HEADER_BYTES} bytes", repr(begin[:20]))
    size = path.stat().st_size
    for kind, number in _ELEMENT.findall(head):
        count = int(number) if number.isdigit() and len(number) < 20 else -1
        title = kind.decode("ascii", "replace")[:40]
        # Each element has at least a byte of its own.
        if not 0 <= count <= size - len(head):
            shown = number.decode("ascii", "replace")[:40]
            raise files.refuse(
                f"{where}: element {title}", f"at most the {size - len(head):,} bytes that follow", shown
            )
        if kind == b"face":
            files.check_faces(count)


def _check_obj(data: bytes, files: SceneFiles, *, place: str) -> None:
    if b"\0" in data[:_HEADER_BYTES]:
        raise files.refuse(place, "text", "zero bytes")
    files.check_faces(data.count(b"\nf "))
    if data.count(b"\no ") + data.count(b"\ng ") + data.count(b"\nusemtl ") > MAX_SHAPES:
        raise files.refuse(place, f"at most {MAX_SHAPES:,} objects", "more")
