"""Where a process writes its log: a file whose reader may go away."""

from __future__ import annotations

from contextlib import suppress
from typing import TextIO


class LogFile:
    """Writes to a text file, and forgets what cannot be written: a log nobody reads ends no work."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def write(self, text: str) -> int:
        """Write text if it can be written."""
        # A pipe whose reader has gone, a disk that is full, a file that was closed.
        with suppress(OSError, ValueError):
            self._file.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush what was written, if it can be."""
        with suppress(OSError, ValueError):
            self._file.flush()
