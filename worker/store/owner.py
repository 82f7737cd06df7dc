"""Whose files a store has: what a worker stores, the service must be able to read and to remove."""

from __future__ import annotations

import pwd
import stat
import tempfile
from pathlib import Path

from lippmann.errors import StoreUnavailable


def check_owner(folder: Path) -> None:
    """Check that the user of a store may read and remove the files that this process makes in it, by making one.

    Parameters
    ----------
    folder
        The folder of the store; it belongs to the user of the service, which made it. One that does not exist yet will
        belong to this process.

    Raises
    ------
    StoreUnavailable
        If the files of this process are closed to that user.
    """
    if not folder.is_dir():
        return
    try:
        # A folder, because tempfile gives files a mode of its own.
        with tempfile.TemporaryDirectory(prefix=".trial-", dir=folder) as made:
            trial = Path(made, "trial")
            trial.mkdir()
            ours, theirs = trial.stat(), folder.stat()
    except OSError as error:
        raise StoreUnavailable(f"cannot write to the store {folder}: {error.strerror}") from error
    shared = ours.st_gid == theirs.st_gid and ours.st_mode & stat.S_IRWXG == stat.S_IRWXG
    if ours.st_uid != theirs.st_uid and not shared:
        raise StoreUnavailable(
            f"expected a worker of {_user(theirs.st_uid)}, to whom the store {folder} belongs, got one of "
            f"{_user(ours.st_uid)}: the service could not read its files. Run the worker as that user, or give the "
            f"folder a group of both (chgrp, chmod 2770) and run both with umask 002"
        )


def _user(number: int) -> str:
    try:
        return f"the user {pwd.getpwuid(number).pw_name}"
    except KeyError:
        return f"the user {number}"
