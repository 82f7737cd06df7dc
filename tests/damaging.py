"""The ways in which an artifact on a disk can be damaged, and readers that must notice each of them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

Damage = Callable[[Path], None]


def truncate(path: Path) -> None:
    """Cut a file to two thirds."""
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])


def flip(path: Path) -> None:
    """Flip one bit in the second half of a file, where its pixels are."""
    data = bytearray(path.read_bytes())
    data[len(data) * 3 // 4] ^= 4
    path.write_bytes(bytes(data))


def empty(path: Path) -> None:
    """Remove the content of a file."""
    path.write_bytes(b"")


def delete(path: Path) -> None:
    """Remove a file."""
    path.unlink()


DAMAGES: tuple[Damage, ...] = (truncate, flip, empty, delete)
