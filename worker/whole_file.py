"""Write files completely, or leave none behind."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from lippmann.errors import NO_ROOM, StoreFull, StoreUnavailable


@contextmanager
def new_file(path: Path) -> Iterator[BinaryIO]:
    """Yield a file for writing; an incomplete file is removed.

    Raises
    ------
    StoreFull
        If there is no room.
    StoreUnavailable
        If the folder cannot be written to.
    """
    try:
        with path.open("wb") as target:
            yield target
    except OSError as error:
        path.unlink(missing_ok=True)
        family = StoreFull if error.errno in NO_ROOM else StoreUnavailable
        raise family(f"cannot write {path.name}: {error.strerror}") from error
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def write_bytes(path: Path, data: bytes) -> None:
    """Write a small file; see `new_file`."""
    with new_file(path) as file:
        file.write(data)
