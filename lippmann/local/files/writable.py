"""Check that a folder can be written, before minutes of work."""

from __future__ import annotations

from pathlib import Path

from lippmann.errors import BadInput


def check_writable(folder: Path) -> None:
    """Check that a folder can be written; a missing folder is created.

    Raises
    ------
    BadInput
        If it cannot be written.
    """
    trial = folder / ".lippmann-trial"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        trial.touch()
        trial.unlink()
    except OSError as error:
        raise BadInput(f"expected a folder that can be written, got {folder}: {error.strerror}") from error
