"""Copies of artifacts on this machine, for whoever reads an artifact of a bucket as a file.

Each copy is in a folder of its own, which is locked while its process lives. So the folders that a killed process left
are known, and the next process that opens the store removes them.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_NEW_S = 60.0
"""The age below which a folder may have been made and not locked yet."""


@contextmanager
def copy_folder(copies: Path) -> Iterator[Path]:
    """Yield a new folder in `copies`, and remove it afterwards."""
    copies.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=copies, ignore_cleanup_errors=True) as name:
        descriptor = os.open(name, os.O_RDONLY | os.O_DIRECTORY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield Path(name)
        finally:
            os.close(descriptor)


def remove_left(copies: Path) -> None:
    """Remove the folders in `copies` that processes left which died."""
    for folder in copies.glob("*"):
        with suppress(OSError):
            if time.time() - folder.stat().st_mtime < _NEW_S:
                continue
            descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(folder)
            finally:
                os.close(descriptor)
