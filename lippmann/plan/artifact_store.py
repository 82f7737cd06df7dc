"""The artifact store as service and workers see it. The implementations are in `worker.store`."""

from __future__ import annotations

import builtins
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, runtime_checkable

from lippmann.digest import Digest, digest_of

RESERVE_MB = 50.0
"""The free space that artifacts leave on a disk, in megabytes: a database on the same disk needs room to record that it
is full, and to remove jobs."""


Moved = Callable[[], object]
"""Is called again and again while bytes are moved, by several threads perhaps: a long transfer is no hung one."""


def unwatched() -> None:
    """Do nothing about a transfer that goes on."""


@dataclass(frozen=True, order=True)
class ArtifactInfo:
    """One artifact in a list."""

    name: str
    """The full name."""
    size: int
    """The size in bytes."""
    modified_s: float
    """Seconds since 1970, UTC."""
    etag: str
    """A strong entity tag, without quotes: two contents of one name never have the same one."""


class ArtifactStore(Protocol):
    """Artifacts by name. An artifact that exists is complete, and a reader keeps reading the content that it opened.

    Names are POSIX paths without a leading slash. A prefix is the first parts of a name, and only whole parts: `a/b`
    means the artifact `a/b` and everything below `a/b/`, but not `a/bc`. The empty prefix means everything.

    Every method raises ValueError for an invalid name, and StoreUnavailable if the store does not answer.

    A store has an id, which is no artifact. A farm knows the id of its store, so that an empty mount point or the store
    of another farm in its place is a store that does not answer, and not a store without artifacts.
    """

    def identity(self) -> str | None:
        """Return the id of the store; None if it has none."""

    def make_identity(self) -> str:
        """Give the store an id unless it has one, and return its id."""

    def expect(self, identity: str | None) -> None:
        """Answer with StoreUnavailable from now on while the store has another id or none; None expects no id.

        What exists under a name may still be read, since its name is a function of its content's definition.
        """

    def put_bytes(self, name: str, data: bytes) -> Digest:
        """Store data completely or not at all, and return its digest; StoreFull if there is no room.

        An artifact of that name is replaced.
        """

    def put_file(self, name: str, path: Path, *, moved: Moved = unwatched) -> Digest:
        """Store a copy of a file completely or not at all; see `put_bytes`."""

    def link(self, source: str, name: str) -> None:
        """Store the content of an artifact under a second name, completely or not at all; on a disk it takes no room.

        Each name keeps the content when the other is deleted or replaced. ArtifactMissing if there is no `source`.
        """

    def get_bytes(self, name: str) -> bytes:
        """Return the content of an artifact; ArtifactMissing if it does not exist."""

    def exists(self, name: str) -> bool:
        """Return whether an artifact exists."""

    def size(self, name: str) -> int:
        """Return the size of an artifact in bytes; ArtifactMissing if it does not exist."""

    def etag(self, name: str) -> str:
        """Return the strong entity tag of an artifact, without quotes; ArtifactMissing if it does not exist."""

    def info(self, name: str) -> ArtifactInfo:
        """Return the size, the time and the entity tag of an artifact, which asks a server once.

        ArtifactMissing is raised if it does not exist.
        """

    def read_range(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        """Return bytes [start, stop) of an artifact in chunks, fewer if the artifact is shorter.

        ArtifactMissing is raised by this call, not with the first chunk. An artifact that is replaced while it is read
        is read to its end with the old content, or StoreUnavailable is raised; the two are never mixed.
        """

    def list(self, prefix: str, *, after: str = "", limit: int | None = None) -> builtins.list[ArtifactInfo]:
        """Return the artifacts below a prefix, sorted by name: those after a name, and at most `limit`."""

    def folders(self) -> builtins.list[str]:
        """Return the first parts of all names with several parts, sorted."""

    def delete(self, prefix: str) -> None:
        """Delete every artifact below a prefix, which must not be empty; deleting nothing is no error."""

    def local_path(self, name: str, *, moved: Moved = unwatched) -> AbstractContextManager[Path]:
        """Provide an artifact as a readable file; ArtifactMissing if it does not exist."""

    def free_bytes(self) -> int | None:
        """Return the free space in bytes; None for a store without a limit."""


@runtime_checkable
class LimitsFiles(Protocol):
    """A store that may take no more files although it has free space."""

    def free_files(self) -> int | None:
        """Return how many more files it takes; None without a limit."""


@runtime_checkable
class HasDownloadUrls(Protocol):
    """A store with a server from which clients download artifacts by themselves."""

    def download_url(self, name: str, *, valid_s: int, disposition: str, media_type: str) -> str:
        """Return a URL from which anybody downloads an artifact within a time, with these headers; no server is asked.

        Whether the artifact exists is not checked. The answers of the URL obey Range and If-Match.
        """


@runtime_checkable
class LeavesPartialFiles(Protocol):
    """A store whose writers leave something that is no artifact when they die."""

    def count_partial(self, older_than_s: float) -> int:
        """Return the number of partial files of that age."""

    def sweep(self, older_than_s: float) -> int:
        """Remove these files, and return their number."""


def moving(chunks: Iterable[bytes], moved: Moved) -> Iterator[bytes]:
    """Yield chunks, and call `moved` after each one."""
    for chunk in chunks:
        yield chunk
        moved()


def read_digest(store: ArtifactStore, name: str, *, moved: Moved = unwatched) -> Digest:
    """Return the digest of an artifact as it is in the store now, which reads all of it.

    Raises
    ------
    lippmann.errors.ArtifactMissing
        If it does not exist.
    """
    return digest_of(moving(store.read_range(name, 0, store.size(name)), moved))
