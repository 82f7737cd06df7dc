"""Files and folders that are complete or absent, and compressed JSON lines with digests."""

from __future__ import annotations

import gzip
import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from lippmann.errors import BadInput
from service.backup.manifest import BackupBroken, Lines

CHUNK_BYTES = 1 << 20
MAX_LINE_BYTES = 256 << 20
"""The largest size of one row as text: the poster or the specification of a large job has megabytes."""
LEVEL = 1
"""The level of compression. Higher ones take three times as long for a tenth less."""


@contextmanager
def new_folder(target: Path) -> Iterator[Path]:
    """Yield a hidden folder that becomes `target` in one step; it is removed on an error.

    Raises
    ------
    BadInput
        If `target` exists, or its parent is not a folder.
    """
    if os.path.lexists(target):
        raise BadInput(f"expected the name of a new folder, got {target}, which exists")
    if not target.parent.is_dir():
        raise BadInput(f"expected a name in a folder that exists, got {target}")
    beside = target.with_name(f".{target.name}.{os.getpid()}.partial")
    try:
        beside.mkdir(mode=0o700)
        yield beside
        for path in sorted(beside.rglob("*"), reverse=True):
            sync(path)
        sync(beside)
        beside.rename(target)
        sync(target.parent)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def sync(path: Path) -> None:
    """Flush a file or a folder to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_lines(path: Path, values: Iterable[Any]) -> Lines:
    """Write values as compressed JSON lines."""
    path.parent.mkdir(parents=True, exist_ok=True)
    count = size = 0
    with path.open("xb") as raw, gzip.GzipFile(fileobj=raw, mode="wb", compresslevel=LEVEL, mtime=0) as file:
        for value in values:
            line = json.dumps(value, separators=(",", ":")).encode() + b"\n"
            file.write(line)
            count, size = count + 1, size + len(line)
    return Lines(lines=count, size=size, sha256=digest_of(path))


def check_lines(path: Path, lines: Lines) -> None:
    """Check that a file of JSON lines is the one that was written.

    Raises
    ------
    BackupBroken
        If it is missing, truncated or altered.
    """
    if not path.is_file() or path.is_symlink():
        raise BackupBroken(f"expected the file {path} of the backup, got nothing there")
    if digest_of(path) != lines.sha256:
        raise BackupBroken(f"{path}: expected the content that was backed up, got another; the backup is damaged")


def read_lines(path: Path, lines: Lines) -> Iterator[Any]:
    """Yield the values in a file of JSON lines, and never decompress more than was written.

    Raises
    ------
    BackupBroken
        If the file is not as long as its manifest says.
    """
    count = size = 0
    with gzip.open(path, "rb") as file:
        while line := file.readline(min(MAX_LINE_BYTES, lines.size - size + 1)):
            count, size = count + 1, size + len(line)
            if size > lines.size or not line.endswith(b"\n"):
                break
            yield json.loads(line)
    if (count, size) != (lines.lines, lines.size):
        raise BackupBroken(f"{path}: expected {lines.lines} lines of {lines.size} bytes, got {count} of {size}")
