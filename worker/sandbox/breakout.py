"""A program that tries to break out of a sandbox and prints what it could do, as JSON.

A worker runs it in its own sandbox before it takes work (`detect.trial`). It is a file of its own
(`python -I -S breakout.py ARGUMENTS`), and every attempt is one that succeeds outside of the sandbox.
"""

from __future__ import annotations

import ctypes
import json
import mmap
import os
import signal
import socket
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

_NEW_USER_NAMESPACE = 0x10000000
_PTRACE_SEIZE = 0x4206
_IPC_CREATE = 0o1600
_libc = ctypes.CDLL(None, use_errno=True)


class Attempts:
    """The attempts; each returns normally only if it succeeded."""

    def __init__(self, aims: dict[str, str]) -> None:
        self._aims = aims

    def read_a_file(self) -> None:
        """Read a file of the worker."""
        Path(self._aims["secret"]).read_bytes()

    def read_accounts(self) -> None:
        """Read the accounts of the machine."""
        Path("/etc/passwd").read_bytes()

    def read_a_process(self) -> None:
        """Read the environment of the worker."""
        Path("/proc", self._aims["pid"], "environ").read_bytes()

    def list_processes(self) -> None:
        """List the processes of the machine."""
        _expect(os.listdir("/proc"))

    def write_over_a_file(self) -> None:
        """Write into a file of the worker."""
        with open(self._aims["secret"], "ab") as file:
            file.write(b"out")

    def write_beside(self) -> None:
        """Write a file beside the folder of the task."""
        _leave(Path(self._aims["secret"]).with_name("written-by-breakout"))

    def write_to_the_scene(self) -> None:
        """Write into a folder that may only be read."""
        _leave(Path(self._aims["readable"], "written-by-breakout"))

    def write_into_the_root_folder(self) -> None:
        """Write into the root folder, which may be in memory."""
        _leave(Path("/written-by-breakout"))

    def write_into_devices(self) -> None:
        """Write into /dev, which may be in memory."""
        _leave(Path("/dev/written-by-breakout"))

    def write_into_shared_memory(self) -> None:
        """Write into /dev/shm."""
        _leave(Path("/dev/shm/written-by-breakout"))  # noqa: S108 - it must fail

    def write_into_the_temporary_folder(self) -> None:
        """Write into /tmp."""
        _leave(Path("/tmp/written-by-breakout"))  # noqa: S108 - it must fail

    def connect(self) -> None:
        """Open a TCP connection to the machine."""
        socket.create_connection(("127.0.0.1", int(self._aims["tcp"])), timeout=1).close()

    def send_a_datagram(self) -> None:
        """Send a UDP datagram to the machine."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.sendto(b"out", ("127.0.0.1", int(self._aims["udp"])))

    def connect_to_a_unix_socket(self) -> None:
        """Connect to a Unix socket of the machine."""
        with socket.socket(socket.AF_UNIX) as client:
            client.connect(self._aims["unix"])

    def connect_to_an_abstract_socket(self) -> None:
        """Connect to an abstract Unix socket of the machine."""
        with socket.socket(socket.AF_UNIX) as client:
            client.connect("\0" + self._aims["abstract"])

    def make_a_symbolic_link(self) -> None:
        """Leave a symbolic link behind."""
        os.symlink(self._aims["secret"], "symbolic")

    def make_a_hard_link(self) -> None:
        """Leave a hard link behind."""
        Path("mine").write_bytes(b"")
        os.link("mine", "hard")

    def make_a_fifo(self) -> None:
        """Leave a named pipe behind."""
        os.mkfifo("fifo")

    def change_rights(self) -> None:
        """Make a folder that its owner cannot remove."""
        os.mkdir("closed")
        os.chmod("closed", 0)

    def fork_many(self) -> None:
        """Start more processes than the limit allows."""
        children = []
        try:
            for _ in range(int(self._aims["processes"]) + 1):
                child = os.fork()
                if child == 0:
                    time.sleep(60)
                    os._exit(0)
                children.append(child)
        finally:
            for child in children:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)

    def take_memory(self) -> None:
        """Take more memory than the limit allows."""
        mmap.mmap(-1, int(self._aims["memory"]) + 1).close()

    def take_memory_in_a_file(self) -> None:
        """Take memory that counts for no limit."""
        os.memfd_create("out")

    def take_shared_memory(self) -> None:
        """Take System V shared memory."""
        _called(_libc.shmget(0, 4096, _IPC_CREATE))

    def hold_a_removed_file(self) -> None:
        """Map a file, so that it keeps its room on the disk after it is removed."""
        with open("mapped", "w+b") as file:
            file.truncate(4096)
            mmap.mmap(file.fileno(), 4096).close()

    def trace_a_process(self) -> None:
        """Attach to the worker as a debugger."""
        _called(_libc.ptrace(_PTRACE_SEIZE, int(self._aims["pid"]), None, None))

    def signal_a_process(self) -> None:
        """Send a signal to the worker."""
        os.kill(int(self._aims["pid"]), 0)

    def become_root(self) -> None:
        """Be root, or become it."""
        os.setuid(0)
        Path("owned").write_bytes(b"")
        os.chown("owned", 1, 1)

    def find_the_environment(self) -> None:
        """Find variables of the worker."""
        _expect([name for name in os.environ if name.startswith("LIPPMANN")])

    def make_a_user_namespace(self) -> None:
        """Become root in a user namespace."""
        _called(_libc.unshare(_NEW_USER_NAMESPACE))


def _leave(path: Path) -> None:
    """Write a file, and remove it if that succeeds: the attempt counts, and the machine stays clean."""
    path.write_bytes(b"out")
    path.unlink()


def _expect(found: object) -> None:
    if not found:
        raise OSError("nothing was found")


def _called(answer: int) -> None:
    if answer < 0:
        raise OSError(ctypes.get_errno(), "refused")


def _succeeds(attempt: Callable[[], None]) -> bool:
    try:
        attempt()
    except (OSError, MemoryError, OverflowError, ValueError):
        return False
    return True


def main(arguments: list[str]) -> None:
    """Make all attempts and print the sentences of those that succeeded."""
    attempts = Attempts(dict(zip(arguments[::2], arguments[1::2], strict=True)))
    names = [name for name, value in vars(Attempts).items() if callable(value) and not name.startswith("_")]
    done = [str(getattr(Attempts, name).__doc__) for name in names if _succeeds(getattr(attempts, name))]
    with tempfile.TemporaryFile(dir=".") as file:  # the folder of the task is the one that can be written
        file.write(b"in")
    print(json.dumps(done))  # noqa: T201 - the output is the result


if __name__ == "__main__":
    main(sys.argv[1:])
