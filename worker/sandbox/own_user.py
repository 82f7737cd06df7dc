"""A user of its own for every program in a sandbox, if the worker is root."""

from __future__ import annotations

import os
import stat
import zlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path

USERS = range(61_184, 65_520)
"""The users that systemd gives to transient services; no account has one of these numbers."""

_CHOWN, _KILL, _SETGID, _SETUID = 0, 5, 6, 7
"""The capabilities that it takes to start a program as another user, and to end it; see linux/capability.h."""

_OTHERS_SEARCH = 0o001
_PASS = 0o011
_OTHERS_READ_FOLDER = 0o005


def own_user(folder: Path) -> int | None:
    """Return the user for the program that works in a folder; None if this process is not root or cannot change users.

    Programs that run at the same time work in different folders, and have different users but for one in 4,336.
    """
    if os.geteuid() != 0 or not _can_change_users():
        return None
    return USERS.start + zlib.crc32(os.fsencode(folder)) % len(USERS)


def hand_over(folder: Path, user: int) -> None:
    """Give a folder and everything in it to a user; links are not followed.

    bwrap enters the folder as root without the rights of root, so others may pass through it, whatever the umask.
    """
    if not folder.is_dir():
        return
    folder.chmod(stat.S_IMODE(folder.stat().st_mode) | _PASS)
    for _, _, files, descriptor in os.fwalk(folder, follow_symlinks=False):
        os.fchown(descriptor, user, user)
        for name in files:
            os.chown(name, user, user, dir_fd=descriptor, follow_symlinks=False)


def let_read(folder: Path, user: int) -> None:
    """Let a user read a folder of this process and everything in it, if it is closed to others."""
    if not folder.is_dir() or folder.stat().st_mode & _OTHERS_READ_FOLDER == _OTHERS_READ_FOLDER:
        return
    for _, _, files, descriptor in os.fwalk(folder, follow_symlinks=False):
        if os.fstat(descriptor).st_uid != os.geteuid():
            continue
        os.fchown(descriptor, -1, user)
        os.fchmod(descriptor, 0o750)
        for name in files:
            _let_read_file(name, descriptor, user)


def _let_read_file(name: str, place: int, user: int) -> None:
    if stat.S_ISREG(os.stat(name, dir_fd=place, follow_symlinks=False).st_mode):
        os.chown(name, -1, user, dir_fd=place, follow_symlinks=False)
        os.chmod(name, 0o640, dir_fd=place)


def is_open_to_all(paths: Iterable[Path]) -> bool:
    """Return whether every user may reach some folders through those above them that are not among them."""
    paths = set(paths)
    above = {folder for path in paths for folder in path.parents if not paths.intersection((folder, *folder.parents))}
    return all(folder.stat().st_mode & _OTHERS_SEARCH for folder in above)


@cache
def _can_change_users() -> bool:
    status = dict(line.split(":", 1) for line in Path("/proc/self/status").read_text().splitlines())
    held = int(status["CapEff"], 16)
    has_rights = all(held >> right & 1 for right in (_CHOWN, _KILL, _SETGID, _SETUID))
    return has_rights and all(_is_mapped(Path("/proc/self", name)) for name in ("uid_map", "gid_map"))


def _is_mapped(id_map: Path) -> bool:
    ranges = [tuple(map(int, line.split())) for line in id_map.read_text().splitlines()]
    return any(inside <= USERS.start and USERS.stop <= inside + count for inside, _, count in ranges)
