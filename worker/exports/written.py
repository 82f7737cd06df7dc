"""A file on its way to disk: what could not be written whole is not left behind."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from worker.errors import NO_ROOM, StoreFull, StoreUnavailable


@contextmanager
def written(path: Path) -> Iterator[BinaryIO]:
    """Lend a new file, open for bytes.

    Raises
    ------
    StoreFull
        If there is no room.
    StoreUnavailable
        If the folder cannot be written to.
    """
    try:
        with path.open("w+b") as file:
            yield file
    except OSError as error:
        path.unlink(missing_ok=True)
        family = StoreFull if error.errno in NO_ROOM else StoreUnavailable
        raise family(f"cannot write {path.name}: {error.strerror}") from error
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def write_bytes(path: Path, data: bytes) -> None:
    """Write a small file; see `written`."""
    with written(path) as file:
        file.write(data)
