"""A stand-in for an engine that was taken over: it does its worst, and what fills something never ends by itself."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path


def reads(*paths: str) -> None:
    """Read files and list folders; print those that can be."""
    print(json.dumps([path for path in paths if _works(_read, path)]))


def writes(*paths: str) -> None:
    """Write, truncate, rename, remove and chmod; print what can be."""
    ways: dict[str, Callable[[str], object]] = {
        "write": lambda path: Path(path).write_bytes(b"out"),
        "append": lambda path: open(path, "ab").close(),
        "truncate": lambda path: os.truncate(path, 0),
        "rename": lambda path: os.rename(path, f"{path}.moved"),
        "remove": os.unlink,
        "make a folder": lambda path: os.mkdir(f"{path}.folder"),
        "touch": os.utime,
        "chmod": lambda path: os.chmod(path, 0o777),
        "chown": lambda path: os.chown(path, os.getuid(), os.getgid()),
    }
    print(json.dumps([f"{name} {path}" for path in paths for name, way in ways.items() if _works(way, path)]))


def sockets() -> None:
    """Make sockets of every kind; print those that can be."""
    families = [family for family in socket.AddressFamily if _works(_socket, family)]
    kinds = [kind for kind in (socket.SOCK_STREAM, socket.SOCK_DGRAM, socket.SOCK_RAW) if _works(_pair, kind)]
    print(json.dumps([str(made) for made in (*families, *kinds)]))


def leftovers(secret: str, picture: str) -> None:
    """Leave links, pipes, folders without end and settings files behind; print what of it could be made."""
    os.mkdir(".povray")
    for name in ("povray.ini", ".povray/povray.conf", "lippmann-frame.pov", "tile.pov"):
        Path(name).write_text(f"+I{secret}\n")
    ways: dict[str, Callable[[], object]] = {
        "symbolic link": lambda: os.symlink(secret, picture),
        "hard link": lambda: os.link("povray.ini", "hard"),
        "named pipe": lambda: os.mkfifo("pipe"),
        "device": lambda: os.mknod("device", 0o20666, os.makedev(1, 1)),
        "setuid": lambda: os.chmod("povray.ini", 0o4777),
        "attribute": lambda: os.setxattr("povray.ini", "user.a", b"b"),
    }
    print(json.dumps([name for name, way in ways.items() if _works(lambda _, way=way: way(), None)]))


def fill_bytes() -> None:
    """Write files of ordinary size without end."""
    for number in range(10**9):
        Path(str(number)).write_bytes(bytes(8 * 2**20))


def fill_removed() -> None:
    """Write files that have no name any more."""
    kept = []
    for _ in range(200):
        file = open("gone", "wb")  # noqa: SIM115
        file.write(bytes(8 * 2**20))
        file.flush()
        os.unlink("gone")
        kept.append(file)
    time.sleep(3600)


def fill_inodes() -> None:
    """Make empty files without end."""
    for number in range(10**9):
        os.close(os.open(str(number), os.O_CREAT))


def fill_depth() -> None:
    """Make folders in folders without end."""
    while True:
        os.mkdir("deeper")
        os.chdir("deeper")


def fill_memory() -> None:
    """Take memory in many processes; where there are none to be had, as much as one may have."""
    try:
        for _ in range(10):
            if os.fork() == 0:
                kept = bytes(100) * 2**20
                time.sleep(3600)
                print(len(kept))
    except OSError:
        taken = [bytes(2**20) for _ in range(10**6)]
        print(len(taken))
    time.sleep(3600)


def fill_processes() -> None:
    """Start processes and threads without end; every failure is tried again at once."""
    threading.stack_size(64 * 1024)
    while True:
        with contextlib.suppress(RuntimeError, MemoryError):
            threading.Thread(target=time.sleep, args=(3600,)).start()
        with contextlib.suppress(OSError):
            if os.fork() == 0:
                time.sleep(3600)


def escapes_its_end() -> None:
    """Leave a process behind in a session of its own, which ignores signals."""
    import signal

    for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGINT):
        signal.signal(number, signal.SIG_IGN)
    try:
        if os.fork():
            return
    except OSError:
        return
    os.setsid()
    if os.fork():
        os._exit(0)
    time.sleep(3600)


def _read(path: str) -> object:
    return os.listdir(path) if os.path.isdir(path) else Path(path).open("rb").read(1)


def _socket(family: int) -> None:
    socket.socket(family, socket.SOCK_STREAM if family != socket.AF_PACKET else socket.SOCK_RAW).close()


def _pair(kind: int) -> None:
    for end in socket.socketpair(socket.AF_UNIX, kind):
        end.close()


def _works(way: Callable[..., object], argument: object) -> bool:
    try:
        way(argument)
    except (OSError, ValueError):
        return False
    return True


def main(words: Iterable[str]) -> None:
    attack, *arguments = words
    globals()[attack](*arguments)


if __name__ == "__main__":
    main(sys.argv[1:])
