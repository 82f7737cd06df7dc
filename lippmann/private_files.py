"""The files of a farm belong to its user: no other user of the machine lists or reads them.

A group may share a farm. Where the umask lets the group write, as 002 does, the group keeps its rights.
"""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from pathlib import Path

_OTHERS = 0o007
_GROUP_WRITES = 0o020
_PASS = 0o011

PARTS = ("artifacts", "broker", "log", "scratch")
"""The folders in a data folder."""
PASSED = "scratch"
"""The one through which the programs in a sandbox pass if the worker is root, because they have users of their own."""


def keep_private() -> None:
    """Close the files that this process and its children make from now on to other users."""
    was = os.umask(0o077)
    if not was & _GROUP_WRITES:
        os.umask(was | _OTHERS)


def make_passable(folder: Path) -> None:
    """Make a folder, and those above it, if they do not exist; if this user is root, other users may pass through them.

    They may not list them, so they reach only what they know by name and what is open to them.
    """
    if folder.is_dir():
        return
    if folder != folder.parent:
        make_passable(folder.parent)
    folder.mkdir(exist_ok=True)
    if os.geteuid() == 0:
        folder.chmod(stat.S_IMODE(folder.stat().st_mode) | _PASS)


def close_parts(data_dir: Path) -> None:
    """Close the folders in a data folder to other users, as an earlier version did not; those of others stay."""
    for name in PARTS:
        folder = data_dir / name
        with suppress(OSError):  # what is not there, or cannot be changed here
            found = folder.stat()
            mode = stat.S_IMODE(found.st_mode) & ~_OTHERS
            if found.st_uid == os.geteuid():
                folder.chmod(mode | _PASS if name == PASSED and os.geteuid() == 0 else mode)
