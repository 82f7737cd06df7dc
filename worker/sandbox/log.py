"""The log of one attempt: the beginning and the end of the output, whatever its length."""

from __future__ import annotations

from collections import deque
from pathlib import Path
from types import TracebackType
from typing import Self

HEAD_BYTES = 1024 * 1024
TAIL_BYTES = 1024 * 1024


class AttemptLog:
    """A text file that keeps its first and its last megabyte.

    The head is on disk at once, so that it can be read while the attempt runs; the tail is added by `close`.
    """

    def __init__(self, path: Path, *, head_bytes: int = HEAD_BYTES, tail_bytes: int = TAIL_BYTES) -> None:
        self.path = path
        self._file = path.open("ab", buffering=0)
        self._head_left = head_bytes
        self._tail_bytes = tail_bytes
        self._tail: deque[bytes] = deque()
        self._tail_size = 0
        self._left_out = 0

    def write(self, line: str) -> None:
        """Add one line."""
        data = line.encode(errors="replace") + b"\n"
        if len(data) <= self._head_left:
            self._head_left -= len(data)
            self._file.write(data)
            return
        self._head_left = 0
        self._tail.append(data)
        self._tail_size += len(data)
        while self._tail_size > self._tail_bytes:
            dropped = len(self._tail.popleft())
            self._tail_size -= dropped
            self._left_out += dropped

    def close(self) -> None:
        """Write the tail, after a line with the number of bytes that were left out."""
        if self._left_out:
            self._file.write(f"[... {self._left_out} bytes left out ...]\n".encode())
        self._file.write(b"".join(self._tail))
        self._tail.clear()
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
