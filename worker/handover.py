"""The handover of a slot: the next attempt starts while the one before it ends.

An engine uses its core only between the start of its parsing and the end of its tracing; before and after, POV-Ray
waits for about 0.3 s each (measured). The assembly of a frame waits for the disk. So a pool process announces that its
attempt will soon need its core no longer, and the consumer takes the next order. A worker has more pool processes than
slots for this, but the attempts that have not announced their end never outnumber the slots.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress

_CHUNK_BYTES = 65_536


class Handover:
    """A pipe from the pool processes to the consumer; it is made before the pool is forked."""

    def __init__(self) -> None:
        self._reader, self._writer = os.pipe()
        for descriptor in (self._reader, self._writer):
            os.set_blocking(descriptor, False)
        self._ending: set[str] = set()
        self._unread = b""

    def announce(self, attempt: str) -> None:
        """Announce in a pool process that an attempt will soon need its core no longer."""
        # A short write to a pipe is never mixed with another. If the pipe is full, the slot is free when the task ends.
        with suppress(OSError):
            os.write(self._writer, attempt.encode() + b"\n")

    def fileno(self) -> int:
        """Return the descriptor that is readable when there are announcements."""
        return self._reader

    def read(self) -> None:
        """Read the announcements in the consumer."""
        with suppress(BlockingIOError):
            while data := os.read(self._reader, _CHUNK_BYTES):
                *lines, self._unread = (self._unread + data).split(b"\n")
                self._ending.update(line.decode() for line in lines)

    def occupied(self, held: Iterable[str]) -> int:
        """Return the number of slots that are not free for another attempt.

        Parameters
        ----------
        held
            All attempts that the worker holds; the announcements of others are forgotten.
        """
        held = set(held)
        self._ending &= held
        return len(held) - len(self._ending)
