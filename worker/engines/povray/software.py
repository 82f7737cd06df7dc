"""The software that makes the pixels of a tile: the version or the digest of each part, for the render cache."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Iterable
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path

from lippmann.errors import PovrayMissing
from lippmann.plan.render_cache import RenderSoftware
from povtemplates.catalogue import INCLUDE_FOLDER, RIGS_FOLDER
from worker.engines.povray.command import SYSTEM_INCLUDE
from worker.engines.povray.version import povray_version
from worker.sandbox.sandbox import PATH

_PACKAGES = [Path(__file__).parents[3] / name for name in ("lippmann", "povtemplates", "worker")]
_LIBRARIES = ("numpy", "OpenImageIO")
"""The libraries that compute rays and pixels."""


def render_software(program: str) -> RenderSoftware:
    """Return the software with which a program renders now; an upgrade is noticed while the worker runs.

    Raises
    ------
    PovrayMissing
        If the program is not installed.
    """
    found = shutil.which(program, path=PATH)
    if found is None:
        raise PovrayMissing(f"POV-Ray is not installed on this worker: no {program!r} in {PATH}.")
    status = Path(found).stat()
    includes_ns = SYSTEM_INCLUDE.stat().st_mtime_ns if SYSTEM_INCLUDE.is_dir() else 0
    return RenderSoftware(
        engine="povray",
        engine_version=_version(found, (status.st_ino, status.st_size, status.st_mtime_ns)),
        engine_includes=_includes(includes_ns),
        templates=_digest(_files((INCLUDE_FOLDER, RIGS_FOLDER), "*")),
        code=_code(),
    )


@lru_cache(maxsize=4)
def _version(program: str, _status: tuple[int, ...]) -> str:
    return povray_version(program)


@lru_cache(maxsize=4)
def _includes(_modified_ns: int) -> str:
    return _digest(_files((SYSTEM_INCLUDE,), "*"))


@cache
def _code() -> str:
    """Return the digest of the code that this process runs, and of the versions of the libraries that compute."""
    libraries = "".join(f"{name} {version(name)}\n" for name in _LIBRARIES)
    return _digest(_files(_PACKAGES, "*.py"), libraries.encode())


def _files(folders: Iterable[Path], pattern: str) -> Iterable[tuple[str, Path]]:
    """Yield the files of folders with their paths below them, sorted."""
    for folder in folders:
        for path in sorted(filter(Path.is_file, folder.rglob(pattern))):
            yield f"{folder.name}/{path.relative_to(folder).as_posix()}", path


def _digest(files: Iterable[tuple[str, Path]], begin: bytes = b"") -> str:
    found = hashlib.sha256(begin)
    for name, path in files:
        data = path.read_bytes()
        found.update(f"{name}\n{len(data)}\n".encode() + data)
    return found.hexdigest()
