"""Write files completely, or leave none behind."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import BinaryIO

from lippmann.errors import NO_ROOM, DiskFull, DiskUnavailable

RESERVE_INODES = 100
"""The free inodes that artifacts and attempts leave on a disk; an attempt needs about 20 at a time."""


@contextmanager
def new_file(path: Path) -> Iterator[BinaryIO]:
    """Yield a file for writing; an incomplete file is removed.

    Raises
    ------
    DiskFull
        If there is no room.
    DiskUnavailable
        If the folder cannot be written to.
    """
    try:
        with path.open("wb") as target:
            yield target
    except OSError as error:
        path.unlink(missing_ok=True)
        family = DiskFull if error.errno in NO_ROOM else DiskUnavailable
        raise family(f"cannot write {path.name}: {error.strerror}") from error
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def write_bytes(path: Path, data: bytes) -> None:
    """Write a small file; see `new_file`."""
    with new_file(path) as file:
        file.write(data)


def lacking_room(folder: Path, *, reserve_bytes: int) -> str | None:
    """Return what the disk of a folder has too little of, bytes or inodes; None if it has enough of both."""
    disk = os.statvfs(folder)
    free = disk.f_bavail * disk.f_frsize
    if free < reserve_bytes:
        return f"{free // 1_000_000} MB are free, and {reserve_bytes // 1_000_000} MB are kept in reserve"
    # Some file systems count no inodes.
    if disk.f_files and disk.f_favail < RESERVE_INODES:
        return f"{disk.f_favail} inodes are free, and {RESERVE_INODES} are kept in reserve"
    return None


def check_folder(folder: Path, *, reserve_bytes: int = 0) -> None:
    """Check that files can be written in a folder, which is created if it does not exist.

    Raises
    ------
    DiskFull
        If there is no room, or less than `reserve_bytes`.
    DiskUnavailable
        If the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        family = DiskFull if error.errno in NO_ROOM else DiskUnavailable
        raise family(f"cannot make {folder}: {error.strerror}") from error
    lacking = lacking_room(folder, reserve_bytes=reserve_bytes)
    if lacking:
        raise DiskFull(f"no room in {folder}: {lacking}")
    try:
        # Without a name, so that a process that is killed meanwhile leaves nothing.
        with TemporaryFile(dir=folder) as trial:
            trial.write(b"trial")
    except OSError as error:
        family = DiskFull if error.errno in NO_ROOM else DiskUnavailable
        raise family(f"cannot write in {folder}: {error.strerror}") from error
