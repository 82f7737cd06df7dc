"""The reserve of SQLite: a file beside the database that is given up when the disk is full.

Then there is room to record that the disk is full, to pause and cancel jobs, and to remove jobs, which makes more room.
"""

from __future__ import annotations

import os
import shutil
from contextlib import suppress
from pathlib import Path

from sqlalchemy.exc import DBAPIError

from lippmann.errors import NO_ROOM

_FULL = ("database or disk is full", "No space left on device", "could not extend file")
"""The words of SQLite and PostgreSQL for a full disk."""


class Reserve:
    """A file of some bytes on the disk of the database.

    Parameters
    ----------
    path
        The file; None for a database that is not a file of this machine.
    """

    def __init__(self, path: Path | None, size_bytes: int) -> None:
        self._path = path if size_bytes > 0 else None
        self._size_bytes = size_bytes

    def keep(self) -> bool:
        """Make the file if it does not exist; return False if there is no room for it.

        Raises
        ------
        OSError
            If the folder cannot be written.
        """
        if self._path is None or self._path.exists():
            return True
        # What the deleted file left free is not yet room for anything else.
        if shutil.disk_usage(self._path.parent).free < 2 * self._size_bytes:
            return False
        beside = self._path.with_name(f"{self._path.name}.part")
        try:
            with beside.open("wb") as file:
                os.posix_fallocate(file.fileno(), 0, self._size_bytes)
            beside.replace(self._path)
        except OSError as error:
            with suppress(OSError):
                beside.unlink()
            if error.errno in NO_ROOM:
                return False
            raise
        return True

    def give_up(self) -> bool:
        """Delete the file; return whether it made room."""
        if self._path is None:
            return False
        try:
            self._path.unlink()
        except OSError:
            return False
        return True

    @property
    def is_given_up(self) -> bool:
        """True if the file was deleted, or was never made."""
        return self._path is not None and not self._path.exists()


def is_full(error: DBAPIError) -> bool:
    """Return whether the disk of the database has no room left."""
    return any(words in str(error.orig) for words in _FULL)
