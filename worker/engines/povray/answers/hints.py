"""Hints for the author of a scene with a message of POV-Ray: the picture that it is about, the dialect."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from worker.engines.povray.answers.messages import Message
from worker.engines.povray.scenes.scene_files import SceneFiles

_FORMAT = re.compile(r"\b(?:PNG|JPEG|GIF|TIFF?|TGA|TARGA|IFF|PGM|PPM|EXR|OPENEXR|HDR|BMP)\b", re.IGNORECASE)
_PICTURES = frozenset(
    {".png", ".jpg", ".jpeg", ".gif", ".tif", ".tiff", ".tga", ".iff", ".pgm", ".ppm", ".exr", ".hdr", ".bmp"}
)
_QUOTED = re.compile(r'"([^"]{1,250})"')
_UNOFFICIAL = re.compile(r"^[ \t]*#[ \t]*version\b[^;\n]{0,200}\bunofficial\b", re.MULTILINE | re.IGNORECASE)
_DIALECT = "The scene is for an unofficial version, such as MegaPOV or UberPOV; Lippmann renders with POV-Ray 3.7."
_LINES = 4
"""The lines up to that of a message in which the name of a picture is looked for."""
_HEAD = 200
_MAX_BYTES, _MAX_TEXT = 16_000_000, 20_000
_BEGINNINGS = (
    (b"version https://git-lfs", "is a pointer of Git LFS; `git lfs pull` fetches the file itself"),
    (b"<", "is HTML or XML"),
    (b"\x89PNG", "is a PNG file, or the beginning of one"),
    (b"\xff\xd8", "is a JPEG file, or the beginning of one"),
    (b"GIF8", "is a GIF file, or the beginning of one"),
    (b"II*\0", "is a TIFF file, or the beginning of one"),
    (b"MM\0*", "is a TIFF file, or the beginning of one"),
    (b"RIFF", "is a WebP file, which POV-Ray does not read"),
)


def with_hint(message: Message, scene: SceneFiles) -> Message:
    """Return an error of a scene, with what is known of its cause.

    A scene can print any text as the name of a file, also one that the system refuses to look up.
    """
    try:
        return _hinted(message, scene)
    except (OSError, ValueError):
        return message


def _hinted(message: Message, scene: SceneFiles) -> Message:
    if message.file is None or message.line is None:
        return message
    path = scene.bundle / message.file
    if not _is_inside(path, scene.bundle) or path.stat().st_size > _MAX_BYTES:
        return message
    lines = path.read_text(errors="replace").splitlines()[: message.line]
    if _FORMAT.search(message.text) and (hint := _picture(lines[-_LINES:], scene)):
        return replace(message, text=f"{message.text}: {hint}")
    if _UNOFFICIAL.search("\n".join(lines[:_HEAD])):
        return replace(message, text=f"{message.text} {_DIALECT}")
    return message


def _picture(lines: list[str], scene: SceneFiles) -> str:
    """Return what the last picture is that some lines name."""
    for name in reversed(_QUOTED.findall("\n".join(lines)[-_MAX_TEXT:])):
        path = scene.found(name)
        if path is not None and path.suffix.lower() in _PICTURES and _is_inside(path, scene.bundle):
            return f"{name!r} {_kind(path)}"
    return ""


def _is_inside(path: Path, folder: Path) -> bool:
    """Return whether a path is a file of a folder; a scene can print any path as that of its error."""
    return path.is_file() and path.resolve().is_relative_to(folder.resolve())


def _kind(path: Path) -> str:
    with path.open("rb") as file:
        begins = file.read(64)
    if not begins:
        return "is empty"
    return next((kind for magic, kind in _BEGINNINGS if begins.startswith(magic)), "is another file, or damaged")
