"""The digest of an artifact, by which a reader notices that it is damaged. The algorithm is chosen here only."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import NamedTuple


class Digest(NamedTuple):
    """The size and the SHA-256 of the content of an artifact."""

    size: int
    """The size in bytes."""
    sha256: str
    """The SHA-256 in hexadecimal digits."""


class DigestWriter:
    """Computes the digest of a content that arrives in chunks, for example while it is written."""

    def __init__(self) -> None:
        self._size = 0
        self._hash = hashlib.sha256()

    def update(self, chunk: bytes) -> None:
        """Add the next chunk of the content."""
        self._size += len(chunk)
        self._hash.update(chunk)

    def digest(self) -> Digest:
        """Return the digest of the content so far."""
        return Digest(self._size, self._hash.hexdigest())


def digest_of(chunks: Iterable[bytes]) -> Digest:
    """Return the digest of a content.

    >>> digest_of([b"a", b"bc"])
    Digest(size=3, sha256='ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad')
    """
    writer = DigestWriter()
    for chunk in chunks:
        writer.update(chunk)
    return writer.digest()
