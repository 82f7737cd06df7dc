"""The file under a temporary name to which a download is written."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from lippmann.digest import digest_of

if TYPE_CHECKING:
    import httpx

_CHUNK_BYTES = 1 << 20

OnBytes = Callable[[int], None]
"""Receives the number of bytes of each part that has come."""


def size_of(part: Path) -> int:
    """Return the bytes that are there already."""
    return part.stat().st_size if part.exists() else 0


def sha256_of(part: Path) -> str:
    """Return the SHA-256 of what is there, in hexadecimal digits."""
    with part.open("rb") as file:
        return digest_of(iter(lambda: file.read(_CHUNK_BYTES), b"")).sha256


def append(part: Path, response: httpx.Response, on_bytes: OnBytes | None) -> None:
    """Write the answer to a request for the rest of a file."""
    if response.status_code != 416:  # With 416, nothing is missing.
        write(part, response, on_bytes, mode="ab" if response.status_code == 206 else "wb")


def write(part: Path, response: httpx.Response, on_bytes: OnBytes | None, *, mode: Literal["ab", "wb"] = "wb") -> None:
    """Write the body of an answer."""
    with part.open(mode) as file:
        for data in response.iter_bytes():
            file.write(data)
            if on_bytes:
                on_bytes(len(data))
