"""Collect what a program in the sandbox was asked for; everything else that it leaves behind is removed unread.

Whatever comes out of a sandbox is untrusted. A file counts only if it was asked for by name, is a regular file with no
other name, and is not larger than it can honestly be. It is opened before it is judged, and no link is followed.
"""

from __future__ import annotations

import os
import stat
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lippmann.errors import DiskUnavailable, RenderFailed

_KINDS = {
    stat.S_IFLNK: "a symbolic link",
    stat.S_IFIFO: "a named pipe",
    stat.S_IFDIR: "a folder",
    stat.S_IFSOCK: "a socket",
}


@contextmanager
def fresh_folder(folder: Path) -> Iterator[Path]:
    """Yield an empty folder for a program in the sandbox; it is removed before and afterwards."""
    remove_tree(folder)
    folder.mkdir()
    try:
        yield folder
    finally:
        remove_tree(folder)


def take_result(folder: Path, name: str, *, into: Path, max_bytes: int) -> Path | None:
    """Move a file that a program left in its folder into a folder of ours; the program has ended.

    Parameters
    ----------
    folder
        The folder that the program could write.
    name
        The name of the file that it was asked for.
    into
        A folder that no program in a sandbox can write.
    max_bytes
        The largest size that the file can honestly have.

    Returns
    -------
    Path or None
        The file, which belongs to this process now; None if the program left none.

    Raises
    ------
    RenderFailed
        If there is something else by that name.
    """
    if name != os.path.basename(name):
        raise ValueError(f"expected the name of a file, got {name!r}")
    place = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    try:
        try:
            _check_kind(os.stat(name, dir_fd=place, follow_symlinks=False), name)
            file = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=place)
        except FileNotFoundError:
            return None
        try:
            found = os.fstat(file)
            _check_kind(found, name)
            if found.st_nlink != 1:
                raise RenderFailed(f"expected a file {name} from the sandbox, got one with {found.st_nlink} names")
            if found.st_size > max_bytes:
                raise RenderFailed(f"expected at most {max_bytes} bytes in {name}, got {found.st_size}")
            os.fchown(file, os.geteuid(), os.getegid())
            os.fchmod(file, 0o644)
            os.rename(name, into / name, src_dir_fd=place)
            if not os.path.samestat(os.lstat(into / name), found):
                raise RenderFailed(f"expected a file {name} from the sandbox, got another one meanwhile")
        finally:
            os.close(file)
    finally:
        os.close(place)
    return into / name


def remove_tree(folder: Path) -> None:
    """Remove a folder whatever is in it; it need not exist.

    `rm` follows no link and removes folders of any depth, where `shutil.rmtree` exceeds the depth of the stack.

    Raises
    ------
    DiskUnavailable
        If something cannot be removed.
    """
    if not folder.is_symlink() and not folder.exists():
        return
    ran = subprocess.run(["rm", "-rf", "--one-file-system", "--", folder], capture_output=True, check=False)
    if ran.returncode:
        raise DiskUnavailable(f"cannot remove {folder}: {ran.stderr.decode(errors='replace').strip()[:300]}")


def _check_kind(found: os.stat_result, name: str) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = _KINDS.get(stat.S_IFMT(found.st_mode), "a device")
        raise RenderFailed(f"expected a file {name} from the sandbox, got {kind}")
