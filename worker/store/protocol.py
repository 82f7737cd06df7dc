"""What a store does."""

from __future__ import annotations

import builtins
from collections.abc import Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol


@dataclass(frozen=True, order=True)
class ArtifactInfo:
    """One artifact in a list."""

    name: str
    size: int
    """Bytes."""
    modified_s: float
    """Seconds since 1970, UTC."""
    etag: str
    """Strong: two contents of one name never share it. Without quotes."""


class ArtifactStore(Protocol):
    """Artifacts by name. What is there is whole, and whoever reads goes on reading what he opened.

    A prefix is a name's first parts, whole parts only: `a/b` means the artifact `a/b` and everything below `a/b/`, not
    `a/bc`. The empty prefix means everything.

    Every method raises ValueError for a name that is none, and StoreUnavailable if the store does not answer.
    """

    def put_bytes(self, name: str, data: bytes) -> None:
        """Store data, whole or not at all; takes the place of what had that name. StoreFull if there is no room."""

    def put_file(self, name: str, path: Path) -> None:
        """Store a copy of a file, whole or not at all; see `put_bytes`."""

    def get_bytes(self, name: str) -> bytes:
        """Return an artifact; ArtifactMissing if it is not there."""

    def exists(self, name: str) -> bool:
        """Return whether an artifact is there."""

    def size(self, name: str) -> int:
        """Return an artifact's bytes; ArtifactMissing if it is not there."""

    def etag(self, name: str) -> str:
        """Return an artifact's strong entity tag, without quotes; ArtifactMissing if it is not there."""

    def read_range(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        """Return bytes [start, stop) of an artifact in chunks, fewer where it ends earlier.

        ArtifactMissing comes at once, not with the first chunk. What is replaced meanwhile is read on as it was.
        """

    def list(self, prefix: str, *, after: str = "", limit: int | None = None) -> builtins.list[ArtifactInfo]:
        """Return the artifacts below a prefix, sorted by name: those after a name, and not more than `limit`."""

    def folders(self) -> builtins.list[str]:
        """Return the first parts of all names that have several, sorted."""

    def delete(self, prefix: str) -> None:
        """Delete every artifact below a prefix, which must not be empty; nothing there is no error."""

    def local_path(self, name: str) -> AbstractContextManager[Path]:
        """Lend an artifact as a readable file; ArtifactMissing if it is not there."""

    def free_bytes(self) -> int | None:
        """Return how much room is left; None for a store that has no end."""
