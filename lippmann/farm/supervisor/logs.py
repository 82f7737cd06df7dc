"""The bounded log of a child."""

from __future__ import annotations

from collections import deque
from pathlib import Path

MAX_BYTES = 2_000_000
"""The largest size of a log file, bytes; the previous file is kept as `.1`."""
LAST_LINES = 20


class BoundedLog:
    """The output of a child, in a file of bounded size; the last lines are also kept in memory."""

    def __init__(self, path: Path, *, max_bytes: int = MAX_BYTES) -> None:
        self.path = path
        self.last_lines: deque[str] = deque(maxlen=LAST_LINES)
        self._max_bytes = max_bytes
        self._open_line = b""

    def write(self, data: bytes) -> list[str]:
        """Add output of the child; return the lines that it completes."""
        self._store(data)
        *whole, self._open_line = (self._open_line + data).split(b"\n")
        if len(self._open_line) > 10_000:
            whole, self._open_line = [*whole, self._open_line], b""
        lines = [line.decode("utf-8", "replace").rstrip() for line in whole]
        self.last_lines.extend(line for line in lines if line)
        return lines

    def _store(self, data: bytes) -> None:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            if self.path.exists() and self.path.stat().st_size + len(data) > self._max_bytes:
                self.path.replace(self.path.with_name(self.path.name + ".1"))
            with self.path.open("ab") as file:
                file.write(data)
        except OSError:
            # A full disk must not end the farm: the children report it where it matters.
            return
