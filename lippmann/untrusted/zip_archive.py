"""Zip files from strangers, with limits on entries, sizes, ratio and names. Nothing is unpacked to find out."""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn

from lippmann.errors import BundleError
from lippmann.untrusted.file_names import check_names, is_clutter

MAX_BYTES = 256 * 1024 * 1024
"""The limit of all files together, unpacked."""
MAX_FILES = 2000
MAX_ENTRIES = 4000
"""The limit of files and folders together."""
MAX_DIRECTORY_BYTES = 2_000_000
"""The limit of the list of entries, which is read at once when the zip is opened."""
MAX_RATIO = 100
"""The limit of the compression of a large bundle. Deflate reaches 1,000 for zeros."""
SMALL_BYTES = 64 * 1024 * 1024
"""The size, unpacked, up to which any compression is accepted: density files are mostly zeros."""

_ENCRYPTED_OR_PATCHED = 0x1 | 0x20 | 0x40
_SAYS_UTF8 = 0x800
_METHODS = frozenset({zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED})
_CHUNK = 64 * 1024
_FAULTS = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, OSError, ValueError, OverflowError, RuntimeError)
"""The errors of `zipfile` for damaged or unusual files; NotImplementedError is a RuntimeError."""


class Archive:
    """A zip file whose list of entries was checked.

    Names are those of the entries with slashes: PowerShell writes backslashes. macOS writes UTF-8 and does not say so.
    Files that an operating system adds are left out.
    """

    def __init__(self, file: zipfile.ZipFile) -> None:
        self._file = file
        if not all(entry.filename for entry in file.infolist()):
            _refuse("a name for every entry", "an entry without one")
        named = [(_name_of(entry).replace("\\", "/"), entry) for entry in file.infolist()]
        files = [(name, entry) for name, entry in named if not name.endswith("/")]
        kept = [(name, entry) for name, entry in files if not is_clutter(name)]
        _check_entries(file.infolist(), [entry for _, entry in kept])
        check_names([name for name, _ in files], [name[:-1] for name, _ in named if name.endswith("/")])
        self._entries = dict(kept)
        self.ignored = [name for name, _ in files if is_clutter(name)]
        """The names of the files that are left out."""

    @property
    def names(self) -> list[str]:
        """The names of the files."""
        return list(self._entries)

    def enter(self, folder: str) -> None:
        """Leave out everything outside a folder; from now on, names are relative to it."""
        above = f"{folder}/"
        self._entries = {
            name.removeprefix(above): entry for name, entry in self._entries.items() if name.startswith(above)
        }

    def read(self, name: str, *, at_most: int) -> bytes:
        """Return the content of a file.

        Raises
        ------
        BundleError
            If the file is larger than `at_most` bytes, or damaged.
        """
        return b"".join(self.chunks(name, at_most=at_most))

    def chunks(self, name: str, *, at_most: int = MAX_BYTES) -> Iterator[bytes]:
        """Yield the content of a file, and no more than its declared size: a small zip may unpack to any size.

        Raises
        ------
        BundleError
            The same as for `read`.
        """
        entry = self._entries[name]
        declared = entry.file_size
        if declared > at_most:
            raise BundleError(f"{name}: expected at most {at_most} bytes, got {declared}")
        size = 0
        try:
            with self._file.open(entry) as file:
                while chunk := file.read(_CHUNK):
                    size += len(chunk)
                    if size > declared:
                        raise BundleError(f"{name}: expected the {declared} bytes that the zip says, got more")
                    yield chunk
        except _FAULTS as error:
            raise BundleError(f"{name}: damaged in the zip: {str(error)[:200]}") from error

    def verify(self) -> None:
        """Read every file and check its sum; the content is not kept.

        Raises
        ------
        BundleError
            If a file is damaged.
        """
        for name in self.names:
            for _ in self.chunks(name):
                pass

    def extract(self, folder: Path) -> None:
        """Write the files into an empty folder.

        Raises
        ------
        BundleError
            If a file is damaged.
        """
        for name in self.names:
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            with target.open("xb") as file:
                file.writelines(self.chunks(name))


@contextmanager
def open_archive(data: bytes) -> Iterator[Archive]:
    """Open a zip file and check its list of entries.

    Raises
    ------
    BundleError
        If it is no zip, has too many or too large files, or a name that `check_names` refuses.
    """
    try:
        file = zipfile.ZipFile(_Bounded(data))
    except _FAULTS as error:
        raise BundleError(f"expected a zip, got {len(data)} bytes that are not one: {str(error)[:200]}") from error
    with file:
        yield Archive(file)


def _name_of(entry: zipfile.ZipInfo) -> str:
    """Return the name of an entry: as UTF-8 if it is that, and otherwise in the code page of DOS, as `zipfile` does."""
    if entry.flag_bits & _SAYS_UTF8:
        return entry.filename
    try:
        return entry.filename.encode("cp437").decode("utf-8")
    except UnicodeError:
        return entry.filename


class _Bounded(io.BytesIO):
    """A file that refuses to be read in large pieces: `zipfile` reads its list of entries at once."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > MAX_DIRECTORY_BYTES:
            raise BundleError(f"expected a list of entries of at most {MAX_DIRECTORY_BYTES:,} bytes, got {size:,}")
        return super().read(size)


def _check_entries(all_entries: list[zipfile.ZipInfo], files: list[zipfile.ZipInfo]) -> None:
    if len(files) > MAX_FILES:
        _refuse(f"at most {MAX_FILES} files", str(len(files)))
    if len(all_entries) > MAX_ENTRIES:
        _refuse(f"at most {MAX_ENTRIES} files and folders", str(len(all_entries)))
    size = sum(entry.file_size for entry in files)
    if size > MAX_BYTES:
        _refuse(f"at most {MAX_BYTES} bytes unpacked", str(size))
    packed = sum(entry.compress_size for entry in files)
    if size > max(SMALL_BYTES, MAX_RATIO * packed):
        _refuse(f"at most {MAX_RATIO} times the packed size beyond {SMALL_BYTES} bytes", f"{packed} bytes for {size}")
    for entry in all_entries:
        name = entry.filename[:80]
        if entry.compress_type not in _METHODS or entry.flag_bits & _ENCRYPTED_OR_PATCHED:
            raise BundleError(f"{name}: expected it stored or deflated, and neither encrypted nor a patch")
        if entry.external_attr >> 16 & 0o170000 == 0o120000:
            _refuse("plain files", f"a link: {name!r}")


def _refuse(expected: str, got: str) -> NoReturn:
    raise BundleError(f"expected {expected}, got {got}")
