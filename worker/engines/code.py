"""The digest of the code of this process, which is part of the key of every tile in the render cache."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from functools import cache
from importlib.metadata import version
from pathlib import Path

_PACKAGES = [Path(__file__).parents[2] / name for name in ("lippmann", "povtemplates", "worker")]
_LIBRARIES = ("numpy", "OpenImageIO")
"""The libraries that compute rays and pixels."""


@cache
def code_digest() -> str:
    """Return the digest of the code that this process runs, and of the versions of the libraries that compute."""
    libraries = "".join(f"{name} {version(name)}\n" for name in _LIBRARIES)
    return digest_of(files_of(_PACKAGES, "*.py"), libraries.encode())


def files_of(folders: Iterable[Path], pattern: str) -> Iterable[tuple[str, Path]]:
    """Yield the files of folders with their paths below them, sorted."""
    for folder in folders:
        for path in sorted(filter(Path.is_file, folder.rglob(pattern))):
            yield f"{folder.name}/{path.relative_to(folder).as_posix()}", path


def digest_of(files: Iterable[tuple[str, Path]], begin: bytes = b"") -> str:
    """Return the SHA-256 digest of files with their names, after some bytes."""
    found = hashlib.sha256(begin)
    for name, path in files:
        data = path.read_bytes()
        found.update(f"{name}\n{len(data)}\n".encode() + data)
    return found.hexdigest()
