"""The data folder: it is writable, has free space, and belongs to one farm."""

from __future__ import annotations

import fcntl
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from lippmann.errors import BadInput
from lippmann.private_files import close_parts, make_passable

LOCK_FILE = "farm.lock"
MIN_FREE_BYTES = 100_000_000
"""The least free space, bytes; less does not hold the first frame of a common job."""
LOCK_PATIENCE_S = 2.0
"""The time for which the lock is tried, s, because a farm that was just killed needs a moment to end."""


@contextmanager
def data_folder(
    folder: Path, *, free_bytes: Callable[[Path], int] | None = None, patience_s: float = LOCK_PATIENCE_S
) -> Iterator[None]:
    """Lock a data folder for one farm; the folder is created if it does not exist.

    Raises
    ------
    BadInput
        If the folder cannot be written, has too little free space, or another farm uses it.
    """
    try:
        make_passable(folder)
        close_parts(folder)
        descriptor = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError as error:
        raise BadInput(f"expected a data folder that can be written, got {folder}: {error.strerror}") from error
    try:
        _lock(descriptor, folder, patience_s)
        _check_room(folder, (free_bytes or _free_bytes)(folder))
        yield
    finally:
        os.close(descriptor)


def _lock(descriptor: int, folder: Path, patience_s: float) -> None:
    until = time.monotonic() + patience_s
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            break
        except BlockingIOError:
            if time.monotonic() > until:
                holder = os.pread(descriptor, 32, 0).decode("ascii", "replace").strip() or "unknown"
                raise BadInput(
                    f"expected a data folder that no farm uses, got {folder}, where one runs (process {holder})"
                ) from None
            time.sleep(0.05)  # flock has no wait with a time limit.
        except OSError as error:
            raise BadInput(f"expected a data folder that can be locked, got {folder}: {error.strerror}") from error
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, str(os.getpid()).encode(), 0)


def _check_room(folder: Path, free: int) -> None:
    if free < MIN_FREE_BYTES:
        raise BadInput(
            f"expected at least {MIN_FREE_BYTES // 1_000_000} MB free in {folder}, got {free // 1_000_000} MB"
        )


def _free_bytes(folder: Path) -> int:
    return shutil.disk_usage(folder).free
