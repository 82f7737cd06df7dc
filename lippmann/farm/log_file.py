"""A log whose reader may go away."""

from __future__ import annotations

from contextlib import suppress
from typing import TextIO


class LogFile:
    """A text file for a log that drops what cannot be written, so that a log without a reader never stops the work."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def write(self, text: str) -> int:
        """Write text if it can be written."""
        # The reader of a pipe may have gone, a disk may be full, and a file may be closed.
        with suppress(OSError, ValueError):
            self._file.write(text)
        return len(text)

    def flush(self) -> None:
        """Flush the file if it can be flushed."""
        with suppress(OSError, ValueError):
            self._file.flush()
