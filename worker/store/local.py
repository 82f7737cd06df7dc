"""A folder on this machine, or on a disk that all machines share.

An artifact is written to a hidden folder of the same file system, flushed to the disk, and renamed to its place; so
a file under a name is complete, also after a power cut. Deleting first renames it into the hidden folder, then removes
it. A process that dies in between leaves files in the hidden folder only, which `sweep` removes later.

The id of the store is in the file `.store`. It is read again for every change and whenever something is missing,
because a disk may be unmounted at any time, which leaves an empty folder in its place.
"""

from __future__ import annotations

import builtins
import errno
import os
import shutil
import stat
import time
import uuid
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import BinaryIO

from lippmann.digest import Digest, DigestWriter
from lippmann.errors import NO_ROOM, ArtifactMissing, StoreFull, StoreUnavailable
from lippmann.plan.artifact_store import ArtifactInfo, Moved, moving, unwatched
from worker.store.names import check_name, check_prefix
from worker.whole_file import lacking_room

HIDDEN = ".partial"
IDENTITY = ".store"
"""The file with the id of the store; no artifact has such a name."""
CHUNK_BYTES = 1 << 18
_NOT_THERE = frozenset({errno.ENOENT, errno.ENOTDIR, errno.EISDIR})
_NO_LINK = frozenset({errno.EXDEV, errno.EPERM, errno.EMLINK, errno.EOPNOTSUPP})
"""The errors of a file system that has no hard links, or no more of them for a file."""


class LocalStore:
    """Artifacts as files below one folder; an `ArtifactStore`. Safe for any number of threads and processes.

    Parameters
    ----------
    reserve_bytes
        The free space of the disk that artifacts leave, bytes. A database on the same disk needs it to record that the
        disk is full, and to remove jobs.
    """

    def __init__(self, root: Path, *, reserve_bytes: int = 0) -> None:
        self._root = root
        self._reserve_bytes = reserve_bytes
        self._hidden = root / HIDDEN
        self._expected: str | None = None
        with _translated("its folder"):
            self._hidden.mkdir(parents=True, exist_ok=True)

    def identity(self) -> str | None:
        """Return the id of the store; None if it has none."""
        with _translated("its id"):
            try:
                return (self._root / IDENTITY).read_text("utf-8", "replace").strip() or None
            except FileNotFoundError:
                return None

    def make_identity(self) -> str:
        """Give the store an id unless it has one, and return its id; of several processes, one makes it."""
        path, partial = self._root / IDENTITY, self._new_hidden()
        try:
            with _translated("its id"):
                with partial.open("x", encoding="utf-8") as file:
                    file.write(f"{uuid.uuid4().hex}\n")
                    file.flush()
                    os.fsync(file.fileno())
                with suppress(FileExistsError):
                    if not _hard_link(partial, path) and not path.exists():
                        partial.replace(path)
                _flush_folder(self._root)
        finally:
            with suppress(OSError):
                partial.unlink(missing_ok=True)
        identity = self.identity()
        if identity is None:
            raise StoreUnavailable(f"cannot give the store an id: {IDENTITY} is empty")
        return identity

    def expect(self, identity: str | None) -> None:
        """Answer with StoreUnavailable from now on while the store has another id or none; None expects no id."""
        self._expected = identity

    def put_bytes(self, name: str, data: bytes) -> Digest:
        """Store data under a name, completely or not at all; it replaces an artifact of that name."""
        return self._put(name, (data,))

    def put_file(self, name: str, path: Path, *, moved: Moved = unwatched) -> Digest:
        """Store a copy of a file under a name, completely or not at all; it replaces an artifact of that name."""
        # The source is opened outside `_translated`: a missing source is the caller's fault, not the store's.
        with path.open("rb") as source:
            return self._put(name, moving(iter(lambda: source.read(CHUNK_BYTES), b""), moved))

    def link(self, source: str, name: str) -> None:
        """Store an artifact under a second name, as a hard link, or as a copy where there can be none."""
        path, partial = self._path(name), self._new_hidden()
        try:
            self._check_identity(name)
            with _translated(source, if_missing=self._check_here):
                if not _hard_link(self._path(source), partial):
                    self.put_file(name, self._path(source))
                    return
            with _translated(name):
                _make_folders(path.parent)
                partial.replace(path)
                _flush_folder(path.parent)
        finally:
            # A link that replaces another one of the same file leaves both.
            with suppress(OSError):
                partial.unlink(missing_ok=True)

    def get_bytes(self, name: str) -> bytes:
        """Return an artifact."""
        with _translated(name, if_missing=self._check_here):
            return self._path(name).read_bytes()

    def exists(self, name: str) -> bool:
        """Return whether an artifact exists."""
        with _translated(name):
            if self._path(name).is_file():
                return True
        self._check_here(name)
        return False

    def size(self, name: str) -> int:
        """Return the size of an artifact, in bytes."""
        return self._status(name).st_size

    def etag(self, name: str) -> str:
        """Return an artifact's strong entity tag: a new file, hence a new tag, with every put."""
        return _etag(self._status(name))

    def info(self, name: str) -> ArtifactInfo:
        """Return the size, the time and the entity tag of an artifact."""
        status = self._status(name)
        return ArtifactInfo(name, status.st_size, status.st_mtime, _etag(status))

    def read_range(self, name: str, start: int, stop: int) -> Iterator[bytes]:
        """Return bytes [start, stop) of an artifact in chunks, fewer where it ends earlier."""
        if not 0 <= start <= stop:
            raise ValueError(f"expected bytes [start, stop) with 0 <= start <= stop, got [{start}, {stop})")
        with _translated(name, if_missing=self._check_here):
            file = self._path(name).open("rb")
        chunks = _chunks(file, name, start, stop)
        # Once started, the generator closes the file even if no chunk is read.
        next(chunks)
        return chunks

    def list(self, prefix: str, *, after: str = "", limit: int | None = None) -> builtins.list[ArtifactInfo]:
        """Return the artifacts below a prefix, sorted by name: those after a name, and not more than `limit`."""
        top = self._root / check_prefix(prefix)
        self._check_here(prefix or "its folder")
        with _translated(prefix):
            return [*islice(_infos(top, top.relative_to(self._root).as_posix(), after), limit)]

    def folders(self) -> builtins.list[str]:
        """Return the first parts of all names that have several, sorted."""
        self._check_here("its folder")
        with _translated("its folder"), os.scandir(self._root) as entries:
            return sorted(entry.name for entry in entries if _is_folder(entry) and not entry.name.startswith("."))

    def delete(self, prefix: str) -> None:
        """Delete every artifact below a prefix; they disappear in one step."""
        if not prefix:
            raise ValueError("expected a prefix, got the empty one, which means every artifact of every job")
        path, away = self._root / check_prefix(prefix), self._new_hidden()
        self._check_here(prefix)
        with _translated(prefix):
            try:
                path.rename(away)
            except (FileNotFoundError, NotADirectoryError):
                return
            _flush_folder(path.parent)
            _remove(away)

    @contextmanager
    def local_path(self, name: str, *, moved: Moved = unwatched) -> Iterator[Path]:
        """Yield the path of an artifact for reading; it is the stored file itself, which must not be changed."""
        self._status(name)
        yield self._path(name)

    def free_bytes(self) -> int | None:
        """Return the free bytes of the disk."""
        with _translated("its folder"):
            return shutil.disk_usage(self._root).free

    def free_files(self) -> int | None:
        """Return how many more files the disk takes; None for a file system without such a limit."""
        with _translated("its folder"):
            found = os.statvfs(self._root)
        return found.f_favail if found.f_files else None

    def sweep(self, older_than_s: float) -> int:
        """Remove partial files that dead processes left more than `older_than_s` ago; return their number.

        `older_than_s` must be longer than any put takes: a put whose file is swept fails, and may be tried again.
        """
        swept = 0
        with _translated("its hidden folder"):
            for path in self._hidden.iterdir():
                with _ignore_missing():
                    if time.time() - path.lstat().st_mtime > older_than_s and _remove(path):
                        swept += 1
        return swept

    def count_partial(self, older_than_s: float) -> int:
        """Return the number of partial files that dead processes left more than `older_than_s` ago."""
        count = 0
        with _translated("its hidden folder"):
            for path in self._hidden.iterdir():
                with _ignore_missing():
                    count += time.time() - path.lstat().st_mtime > older_than_s
        return count

    def _path(self, name: str) -> Path:
        return self._root / check_name(name)

    def _status(self, name: str) -> os.stat_result:
        with _translated(name, if_missing=self._check_here):
            status = self._path(name).stat()
        if not _is_file(status):
            raise ArtifactMissing(f"expected the artifact {name}, got a folder of artifacts")
        return status

    def _new_hidden(self) -> Path:
        return self._hidden / uuid.uuid4().hex

    def _check_here(self, what: str) -> None:
        """Raise StoreUnavailable if this store is away: then nothing is known to be missing."""
        with _translated(what):
            self._hidden.stat()
        self._check_identity(what)

    def _check_identity(self, what: str) -> None:
        if self._expected is None:
            return
        found = self.identity()
        if found is None:
            with _translated(what):
                self._root.stat()
        if found != self._expected:
            other = "has no id" if found is None else f"is another store, {found}"
            raise StoreUnavailable(f"cannot use {what} in the store: the folder in its place {other}")

    def _put(self, name: str, chunks: Iterable[bytes]) -> Digest:
        path, partial = self._path(name), self._new_hidden()
        self._check_identity(name)
        try:
            with _translated(name):
                self._check_room(name)
                with partial.open("xb") as file:
                    digest = _write_all(file, chunks)
                    file.flush()
                    self._check_room(name)
                    _stamp(file)
                    os.fsync(file.fileno())
                _make_folders(path.parent)
                partial.replace(path)
                _flush_folder(path.parent)
            return digest
        finally:
            # The first error is reported; a file that cannot be removed here is swept later.
            with suppress(OSError):
                partial.unlink(missing_ok=True)

    def _check_room(self, name: str) -> None:
        if not self._reserve_bytes:
            return
        lacking = lacking_room(self._root, reserve_bytes=self._reserve_bytes)
        if lacking:
            raise StoreFull(f"no room for {name}: {lacking}")


def _write_all(file: BinaryIO, chunks: Iterable[bytes]) -> Digest:
    """Write chunks and return their digest, for which the file is not read again."""
    written = DigestWriter()
    for chunk in chunks:
        file.write(chunk)
        written.update(chunk)
    return written.digest()


def _hard_link(source: Path, target: Path) -> bool:
    """Make a hard link; return False if the file system makes none."""
    try:
        os.link(source, target)
    except OSError as error:
        if error.errno not in _NO_LINK:
            raise
        return False
    return True


def _stamp(file: BinaryIO) -> None:
    # The kernel's own time stamps are 4 ms apart; a name may be put twice within that, and the etags must differ.
    now_ns = time.time_ns()
    os.utime(file.fileno(), ns=(now_ns, now_ns))


def _chunks(file: BinaryIO, name: str, start: int, stop: int) -> Iterator[bytes]:
    with file, _translated(name):
        file.seek(start)
        yield b""
        while (left := stop - file.tell()) > 0 and (chunk := file.read(min(left, CHUNK_BYTES))):
            yield chunk


def _infos(top: Path, name: str, after: str) -> Iterator[ArtifactInfo]:
    """Yield the artifact or the artifacts at `top`, called `name`, in the order of names.

    Artifacts that are deleted meanwhile are left out.
    """
    if not top.is_file():
        yield from _infos_in(top, "" if name == "." else name + "/", after)
    elif name > after:
        with _ignore_missing():
            yield _info(name, top.stat())


def _infos_in(folder: Path, prefix: str, after: str) -> Iterator[ArtifactInfo]:
    # A folder sorts by its name with the slash, as its names do: `a-b` comes before the names in `a`.
    found: dict[str, os.DirEntry[str]] = {}
    with _ignore_missing(), os.scandir(folder) as entries:
        shown = (entry for entry in entries if not entry.name.startswith("."))
        found = {prefix + entry.name + ("/" if _is_folder(entry) else ""): entry for entry in shown}
    for name, entry in sorted(found.items()):
        if name.endswith("/"):
            if name > after or after.startswith(name):
                yield from _infos_in(Path(entry.path), name, after)
        elif name > after:
            with _ignore_missing():
                yield _info(name, entry.stat())


def _is_folder(entry: os.DirEntry[str]) -> bool:
    return entry.is_dir(follow_symlinks=False)


def _info(name: str, status: os.stat_result) -> ArtifactInfo:
    return ArtifactInfo(name=name, size=status.st_size, modified_s=status.st_mtime, etag=_etag(status))


def _etag(status: os.stat_result) -> str:
    return f"{status.st_size:x}-{status.st_mtime_ns:x}-{status.st_ino:x}"


def _is_file(status: os.stat_result) -> bool:
    return stat.S_ISREG(status.st_mode)


def _make_folders(folder: Path) -> None:
    """Make a folder that survives a power cut: every new folder is flushed into its parent."""
    if folder.is_dir():
        return
    _make_folders(folder.parent)
    folder.mkdir(exist_ok=True)
    _flush_folder(folder.parent)


def _flush_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _remove(path: Path) -> bool:
    """Remove a hidden file or folder; return whether it is gone. A later sweep tries again."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)
    return not os.path.lexists(path)


@contextmanager
def _ignore_missing() -> Iterator[None]:
    try:
        yield
    except (FileNotFoundError, NotADirectoryError):
        return


@contextmanager
def _translated(what: str, *, if_missing: Callable[[str], None] | None = None) -> Iterator[None]:
    """Translate errors of the operating system.

    With `if_missing`, a missing file means a missing artifact, unless this check finds that the store is away.
    """
    try:
        yield
    except OSError as error:
        if error.errno in NO_ROOM:
            raise StoreFull(f"no room for {what}: {error.strerror}") from error
        if if_missing is not None and error.errno in _NOT_THERE:
            if_missing(what)
            raise ArtifactMissing(f"expected the artifact {what}, got nothing there") from error
        raise StoreUnavailable(f"cannot reach {what} in the store: {error.strerror}") from error
