"""The folder with the files of a scene bundle: unpacked once, and whole before and after each use."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from lippmann.errors import BundleError, Permanent, ScratchDamaged
from lippmann.plan.artifact_names import bundle_name
from lippmann.plan.artifact_store import ArtifactStore
from lippmann.private_files import make_passable
from worker.sandbox.bundle import digest_of, listing_of, unpack
from worker.tasks.folder_lock import folder_lock

UNPACKED = "2"
"""The version of what `unpack` makes of a bundle. It is in the name of the folder, so that a worker of another version
unpacks the bundle anew."""


@contextlib.contextmanager
def unpacked_bundle(store: ArtifactStore, digest: str, bundles_dir: Path) -> Iterator[Path]:
    """Yield the folder with a scene bundle's files, unpacked once for all attempts.

    Raises
    ------
    BundleError
        If the bundle in the store has another content than its name says.
    ArtifactMissing
        If the store does not have the bundle.
    ScratchDamaged
        If files in the folder were removed or changed meanwhile. What was made of them counts for nothing, and an
        error is no fault of the scene. The next use unpacks the bundle again.
    OSError
        If it cannot be unpacked: only a folder that is complete is used.
    """
    folder = bundles_dir / f"{digest}-{UNPACKED}"
    if not _is_whole(folder):
        _unpack(store, digest, folder)
    os.utime(folder)
    number = folder.stat().st_ino
    try:
        yield folder.resolve()
    except Permanent as error:
        _check_whole(folder, number, error)
        raise
    _check_whole(folder, number)


def remove_bundle(folder: Path) -> None:
    """Remove the folder of a bundle."""
    shutil.rmtree(folder)
    _listing_file(folder).unlink(missing_ok=True)


def _unpack(store: ArtifactStore, digest: str, folder: Path) -> None:
    make_passable(folder.parent)
    beside = Path(tempfile.mkdtemp(prefix=f".{digest[:8]}-", dir=folder.parent))
    try:
        data = store.get_bytes(bundle_name(digest))
        if digest_of(data) != digest:
            raise BundleError(f"expected the bundle {digest[:12]} in the store, got other content there")
        whole = beside / "whole"
        whole.mkdir()
        unpack(data, whole)
        if os.geteuid() == 0:  # Programs in the sandbox run as users of their own.
            for path in (whole, *whole.rglob("*")):
                path.chmod(0o755 if path.is_dir() else 0o644)
        listing = beside / "listing"
        listing.write_text(listing_of(whole), encoding="utf-8")
        with folder_lock(folder.parent, wait=True):
            if _is_whole(folder):  # Another attempt was quicker.
                return
            if folder.is_dir():
                folder.rename(beside / "damaged")
            whole.rename(folder)
            listing.replace(_listing_file(folder))
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _listing_file(folder: Path) -> Path:
    """Return the file that lists what was unpacked into the folder of a bundle."""
    return folder.with_name(f"{folder.name}.json")


def _is_whole(folder: Path) -> bool:
    try:
        return listing_of(folder) == _listing_file(folder).read_text(encoding="utf-8")
    except OSError:
        return False


def _check_whole(folder: Path, number: int, error: Exception | None = None) -> None:
    """Check that a folder is whole, and still the one with this inode number: it may have been replaced."""
    if not _is_whole(folder) or folder.stat().st_ino != number:
        message = "files of the scene disappeared from the scratch folder of the worker while it used them"
        raise ScratchDamaged(message) from error
