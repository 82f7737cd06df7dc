"""The folder with the files of a scene bundle: unpacked once, and whole before and after each use.

Together the folders have a limit: whoever unpacks another bundle removes those that were used least recently. Each use
shares the lock of its folder, and only a folder whose lock nobody has is removed.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import structlog

from lippmann.errors import BundleError, Permanent, ScratchDamaged
from lippmann.plan.artifact_names import bundle_name
from lippmann.plan.artifact_store import ArtifactStore
from lippmann.private_files import make_passable
from worker.sandbox.bundle import digest_of, listing_of, unpack
from worker.tasks.scenes.folder_lock import folder_lock

log = structlog.get_logger()

UNPACKED = "2"
"""The version of what `unpack` makes of a bundle. It is in the name of the folder, so that a worker of another version
unpacks the bundle anew."""


@contextlib.contextmanager
def unpacked_bundle(store: ArtifactStore, digest: str, bundles_dir: Path, *, limit_bytes: int) -> Iterator[Path]:
    """Yield the folder with a scene bundle's files, unpacked once for all attempts.

    Parameters
    ----------
    limit_bytes
        The size of all unpacked bundles above which the least recently used ones are removed, in bytes.

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
    with contextlib.ExitStack() as use:
        if not _hold(folder, use):
            _unpack(store, digest, folder, use, limit_bytes=limit_bytes)
        os.utime(folder)
        number = folder.stat().st_ino
        try:
            yield folder.resolve()
        except Permanent as error:
            _check_whole(folder, number, error)
            raise
        _check_whole(folder, number)


def remove_bundle(folder: Path) -> None:
    """Remove the folder of a bundle.

    Raises
    ------
    BlockingIOError
        If an attempt uses it.
    """
    with folder_lock(folder):
        shutil.rmtree(folder)
        _listing_file(folder).unlink(missing_ok=True)


def _hold(folder: Path, use: contextlib.ExitStack) -> bool:
    """Let nobody remove a folder while it is used; return False if it is not whole."""
    with contextlib.suppress(FileNotFoundError), contextlib.ExitStack() as held:
        number = folder.stat().st_ino
        held.enter_context(folder_lock(folder, wait=True, shared=True))
        # It may have been removed, and unpacked again, before the lock was there.
        if _is_whole(folder) and folder.stat().st_ino == number:
            use.push(held.pop_all())
            return True
    return False


def _unpack(store: ArtifactStore, digest: str, folder: Path, use: contextlib.ExitStack, *, limit_bytes: int) -> None:
    make_passable(folder.parent)
    with _folder_beside(folder) as beside:
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
            if not _is_whole(folder):  # Otherwise, another attempt was quicker.
                if folder.is_dir():
                    folder.rename(beside / "damaged")
                whole.rename(folder)
                listing.replace(_listing_file(folder))
            use.enter_context(folder_lock(folder, wait=True, shared=True))
            _remove_least_recent(folder, limit_bytes)


@contextlib.contextmanager
def _folder_beside(folder: Path) -> Iterator[Path]:
    """Yield a folder in which a bundle is unpacked; its name begins with a dot, and `sweep_attempts` knows its lock."""
    with contextlib.ExitStack() as stack:
        with folder_lock(folder.parent, wait=True):  # a folder that is not locked yet is not swept
            beside = Path(tempfile.mkdtemp(prefix=f".{folder.name[:8]}-", dir=folder.parent))
            stack.callback(shutil.rmtree, beside, ignore_errors=True)
            stack.enter_context(folder_lock(beside))
        yield beside


def _remove_least_recent(new: Path, limit_bytes: int) -> None:
    """Remove the least recently used bundles beside a new one until all have the limit; those in use stay."""
    folders = [path for path in new.parent.iterdir() if path.is_dir() and not path.name.startswith(".")]
    sizes = {folder: _size_bytes(folder) for folder in folders}
    total = sum(sizes.values())
    for folder in sorted(sizes, key=lambda folder: folder.stat().st_mtime):
        if total <= limit_bytes:
            return
        if folder == new:
            continue
        try:
            remove_bundle(folder)
            total -= sizes[folder]
        except BlockingIOError:
            continue
        except OSError as error:
            log.warning("bundle not removed", folder=str(folder), error=str(error))


def _size_bytes(folder: Path) -> int:
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


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
