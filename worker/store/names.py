"""The rules for names of artifacts."""

from __future__ import annotations

MAX_PART_BYTES = 255
"""The limit of file systems for one part of a path."""

MAX_NAME_BYTES = 1024
"""The limit of object stores for a whole name."""


def check_name(name: str) -> str:
    """Return a valid name: parts between slashes, none empty, none beginning with a dot, no control characters.

    So no name leads out of the store, is absolute, or is one of the store's own hidden files.

    Raises
    ------
    ValueError
        If the name is not valid.
    """
    parts = name.split("/")
    fault = (
        not all(parts)
        or any(part.startswith(".") for part in parts)
        or any(character < " " or character == "\x7f" for character in name)
        or any(len(part.encode()) > MAX_PART_BYTES for part in parts)
        or len(name.encode()) > MAX_NAME_BYTES
    )
    if fault:
        raise ValueError(f"expected an artifact's name like 'views/0001.exr', got {name!r}")
    return name


def check_prefix(prefix: str) -> str:
    """Return a prefix without its closing slash; it is empty or a valid name.

    Raises
    ------
    ValueError
        If it is not.
    """
    return check_name(prefix.removesuffix("/")) if prefix else prefix
