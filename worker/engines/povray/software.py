"""The software that makes the pixels of a tile: the version or the digest of each part, for the render cache."""

from __future__ import annotations

import shutil
from functools import lru_cache
from pathlib import Path

from lippmann.errors import PovrayMissing
from lippmann.plan.render_cache import RenderSoftware
from povtemplates.catalogue import INCLUDE_FOLDER, RIGS_FOLDER
from worker.engines.code import code_digest, digest_of, files_of
from worker.engines.povray.command import SYSTEM_INCLUDE
from worker.engines.povray.version import povray_version
from worker.sandbox.sandbox import PATH


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
        templates=digest_of(files_of((INCLUDE_FOLDER, RIGS_FOLDER), "*")),
        code=code_digest(),
    )


@lru_cache(maxsize=4)
def _version(program: str, _status: tuple[int, ...]) -> str:
    return povray_version(program)


@lru_cache(maxsize=4)
def _includes(_modified_ns: int) -> str:
    return digest_of(files_of((SYSTEM_INCLUDE,), "*"))
