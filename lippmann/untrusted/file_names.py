"""The names of files in an archive from a stranger: relative, printable, and different on every file system."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Sequence
from typing import NoReturn

from lippmann.errors import BundleError

MAX_NAME_BYTES = 200
"""The greatest length of one part of a name; file systems take 255."""
MAX_PATH_BYTES = 1000
MAX_DEPTH = 16
"""The greatest number of parts of a name."""
MAX_FOLDERS = 1000

HIDDEN_SETTINGS = ".povray"
"""The folder in which POV-Ray looks for its settings and for its limits on files."""

_INVISIBLE = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})
"""The Unicode categories of control characters, marks of direction, halves of surrogate pairs and line ends."""
_DEVICE = re.compile(r"(?:con|prn|aux|nul|conin\$|conout\$|com\d|lpt\d)(?:\..*)?", re.IGNORECASE | re.DOTALL)


CLUTTER = frozenset({"__macosx", ".ds_store", "thumbs.db", "ehthumbs.db", "desktop.ini", ".git", ".svn", ".hg"})
"""The names of files and folders that an operating system or a version control puts among a person's own."""


def is_clutter(name: str) -> bool:
    """Return whether a name is that of a file that no person made, such as `__MACOSX/._scene.pov`.

    >>> is_clutter("wood/.DS_Store"), is_clutter("._wood.png"), is_clutter("wood.png")
    (True, True, False)
    """
    return any(part.startswith("._") or part.casefold() in CLUTTER for part in name.split("/"))


def check_names(files: Sequence[str], folders: Sequence[str] = ()) -> None:
    """Check the names of the files of an archive, and of the folders that it lists.

    Raises
    ------
    BundleError
        If a name leads out of its folder, is too long or too deep, contains an invisible character, is the name of a
        device, or is the name of another file or folder on some file system.
    """
    for name in (*files, *folders):
        _check_name(name)
    above = {place for name in (*files, *folders) for place in _folders_above(name)} | set(folders)
    if len(above) > MAX_FOLDERS:
        raise BundleError(f"expected at most {MAX_FOLDERS:,} folders, got {len(above):,}")
    _check_no_conflict(files, above)


def _folders_above(name: str) -> Iterator[str]:
    parts = name.split("/")
    return ("/".join(parts[:place]) for place in range(1, len(parts)))


def _check_name(name: str) -> None:
    if len(name) > MAX_PATH_BYTES:
        _refuse(f"names of at most {MAX_PATH_BYTES} bytes", name)
    if any(unicodedata.category(letter) in _INVISIBLE for letter in name):
        _refuse("names without control characters and marks of direction", name)
    if len(name.encode()) > MAX_PATH_BYTES:
        _refuse(f"names of at most {MAX_PATH_BYTES} bytes", name)
    parts = name.split("/")
    if "\\" in name or any(part in ("", ".", "..") for part in parts):
        _refuse("names inside the bundle", name)
    if len(parts) > MAX_DEPTH:
        _refuse(f"names of at most {MAX_DEPTH} parts", name)
    if any(len(part.encode()) > MAX_NAME_BYTES for part in parts):
        _refuse(f"names of at most {MAX_NAME_BYTES} bytes", name)
    if any(_DEVICE.fullmatch(part) for part in parts):
        _refuse("names that are no devices of Windows, such as NUL", name)
    if any(part.casefold().startswith(HIDDEN_SETTINGS) for part in parts):
        _refuse("no hidden settings of POV-Ray", name)


def _check_no_conflict(names: Sequence[str], folders: set[str]) -> None:
    """Refuse a name that occurs twice, or that is both a file and a folder, where case and accents do not count."""
    if len(set(names)) < len(names) or folders.intersection(names):
        raise BundleError("expected every name once, and none both as a file and as a folder")
    plain: dict[str, str] = {}
    for name in (*names, *folders):
        other = plain.setdefault(plain_name(name), name)
        if other != name and not (other in folders and name in folders):
            raise BundleError(
                "expected names that differ by more than case and the composition of accents, "
                f"got {_shown(name)} and {_shown(other)}"
            )


def plain_name(name: str) -> str:
    """Return what names have in common that a file system of Windows or macOS takes for one.

    >>> plain_name("Maps/WOOD.PNG")
    'maps/wood.png'
    """
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def _refuse(expected: str, name: str) -> NoReturn:
    raise BundleError(f"expected {expected}, got {_shown(name)}")


def _shown(name: str) -> str:
    return repr(name) if len(name) <= 80 else f"{name[:80]!r}..."
