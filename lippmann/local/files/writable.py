"""Check that a folder can be written, before minutes of work."""

from __future__ import annotations

from pathlib import Path
from tempfile import NamedTemporaryFile

from lippmann.errors import BadInput


def check_writable(folder: Path) -> None:
    """Check that a folder can be written; a missing folder is created.

    Several processes may check the same folder at the same time.

    Raises
    ------
    BadInput
        If it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=folder, prefix=".lippmann-trial-"):
            pass
    except OSError as error:
        raise BadInput(f"expected a folder that can be written, got {folder}: {error.strerror}") from error
