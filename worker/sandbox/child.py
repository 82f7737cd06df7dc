"""A child process: its start, its output, its end, and its descendants."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Self, cast

GRACE_S = 1.6
"""The time from SIGTERM to SIGKILL. POV-Ray ends within 0.9 s while it renders and 1.5 s while it parses."""
DRAIN_S = 1.0
"""The time for which output is read after the child has ended, if another process keeps the pipe open."""
FREEZE_S = 10.0
"""The time in which a child stands still that is told to; a system call can hold it up."""

_ALL_S = 0.3
"""The time from SIGKILL for the leaf processes to SIGKILL for all."""
_CHUNK_BYTES = 65_536
_REAP_S = 0.01
_STOP_S = 0.0005


class LostCpu:
    """The CPU seconds of processes below children of this process for which nobody waited, so `getrusage` lacks them.

    The kernel ends all processes of a group at once, and then those below the child have no parent that waits.
    """

    def __init__(self) -> None:
        self.seconds = 0.0

    def add(self, *, counted_s: float, of_group_s: float) -> None:
        """Add what a group has used and the children of this process have not."""
        self.seconds += max(0.0, of_group_s - counted_s)

    def lend(self, seconds: float) -> None:
        """Count CPU seconds of a child that goes on, or take them back with a negative number when it has ended."""
        self.seconds += seconds


lost_cpu = LostCpu()
"""Those of this process, which makes one attempt at a time."""


class Child:
    """A process that leads its own session; as a context manager, it has ended when the context is left."""

    def __init__(self, argv: Sequence[str], *, cwd: Path, env: Mapping[str, str], listens: bool = False) -> None:
        """Start a process; one that `listens` reads what is sent to it, any other has an empty input."""
        self.exit_code = 0
        self.cpu_s = 0.0
        self.peak_memory_mb = 0.0
        self._ended_s: float | None = None
        self._terminated_s: float | None = None
        self._popen = subprocess.Popen(
            argv,
            cwd=cwd,
            env=env,
            stdin=subprocess.PIPE if listens else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        self._output = cast(IO[bytes], self._popen.stdout)
        self._unsent = b""
        if self._popen.stdin:
            # A child that does not read must not hold up this process.
            os.set_blocking(self._popen.stdin.fileno(), False)

    def pids(self) -> list[int]:
        """Return the child and all processes below it; empty when it has ended."""
        return [] if self._ended_s is not None else [self._popen.pid, *_descendants(self._popen.pid)]

    def send(self, data: bytes) -> None:
        """Send bytes to a child that listens, as soon as it reads them: while `read` waits for output."""
        self._unsent += data

    def used_cpu_s(self) -> float:
        """Return the CPU seconds so far of the child and of all processes below it, those that have ended included."""
        return self.cpu_s if self._ended_s is not None else sum(map(_cpu_s, self.pids()))

    def freeze(self) -> bool:
        """Stop the child and all processes below it until `thaw`; they can still be ended.

        Returns
        -------
        bool
            True if all of them stand still; False if one did not within `FREEZE_S`.
        """
        ends_s = time.monotonic() + FREEZE_S
        pids = self.pids()
        while True:
            self._signal(pids, signal.SIGSTOP)
            # Threads stop one after the other, and one that runs may start a process.
            still = all(_stands_still(pid) for pid in pids)
            before, pids = pids, self.pids()
            if still and set(pids) <= set(before):
                return True
            if time.monotonic() > ends_s:
                return False
            time.sleep(_STOP_S)

    def thaw(self) -> None:
        """Let the child go on."""
        self._signal(self.pids(), signal.SIGCONT)

    def read(self, timeout_s: float) -> bytes:
        """Wait for output, at most for this time, and return it."""
        data = self._read(timeout_s)
        self._reap(os.WNOHANG)
        return data

    def is_over(self) -> bool:
        """Return whether the child has ended and all its output has been read."""
        if self._ended_s is None:
            return False
        return self._output.closed or time.monotonic() - self._ended_s > DRAIN_S

    def end(self) -> None:
        """End the child: call this until `is_over`.

        SIGTERM, then SIGKILL, are sent to the leaves of the process tree: the engine, not the sandbox around it, which
        counts its CPU seconds. At last SIGKILL is sent to all.
        """
        now_s = time.monotonic()
        if self._terminated_s is None:
            self._terminated_s = now_s
            self._signal(self._leaves(), signal.SIGTERM)
        elif now_s - self._terminated_s > GRACE_S + _ALL_S:
            self._kill_all()
        elif now_s - self._terminated_s > GRACE_S:
            self._signal(self._leaves(), signal.SIGKILL)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._ended_s is None:
            self._kill_all()
            self._reap(0)
        # The pipe closes when the last descendant, which the kernel kills after its leader, has ended.
        while not self.is_over():
            self._read(_REAP_S)
        self._output.close()
        if self._popen.stdin:
            self._popen.stdin.close()

    def _read(self, timeout_s: float) -> bytes:
        if self._output.closed:
            time.sleep(_REAP_S)
            return b""
        # Not `select.select`, which refuses descriptors above 1023: a worker with many slots has more.
        poll = select.poll()
        poll.register(self._output, select.POLLIN)
        if self._unsent and self._popen.stdin:
            poll.register(self._popen.stdin, select.POLLOUT)
        ready = {descriptor for descriptor, _ in poll.poll(timeout_s * 1000)}
        if ready - {self._output.fileno()}:
            self._send()
        if self._output.fileno() not in ready:
            return b""
        data = os.read(self._output.fileno(), _CHUNK_BYTES)
        if not data:
            self._output.close()
        return data

    def _send(self) -> None:
        assert self._popen.stdin is not None  # noqa: S101 - a child that does not listen is sent nothing
        try:
            self._unsent = self._unsent[os.write(self._popen.stdin.fileno(), self._unsent) :]
        except BlockingIOError:
            return
        except BrokenPipeError:
            self._unsent = b""

    def _reap(self, flags: int) -> None:
        if self._ended_s is not None or not os.waitid(os.P_PID, self._popen.pid, os.WEXITED | os.WNOWAIT | flags):
            return
        # Until the dead leader is waited for, its process number cannot be used again for another group.
        self._kill_group()
        _, status, used = os.wait4(self._popen.pid, 0)
        self._ended_s = time.monotonic()
        # Popen must not wait for a process that was waited for.
        self._popen.returncode = self.exit_code = os.waitstatus_to_exitcode(status)
        self.cpu_s = used.ru_utime + used.ru_stime
        self.peak_memory_mb = used.ru_maxrss / 1024

    def _signal(self, pids: Sequence[int], number: int) -> None:
        if self._ended_s is None:
            for pid in pids:
                with suppress(ProcessLookupError):
                    os.kill(pid, number)

    def _leaves(self) -> list[int]:
        below = _descendants(self._popen.pid)
        return [pid for pid in below if not _children(pid)] or [self._popen.pid]

    def _kill_all(self) -> None:
        self._signal(_descendants(self._popen.pid), signal.SIGKILL)
        self._kill_group()

    def _kill_group(self) -> None:
        if self._ended_s is None:
            with suppress(ProcessLookupError):
                os.killpg(self._popen.pid, signal.SIGKILL)


def _descendants(pid: int) -> list[int]:
    below = []
    for child in _children(pid):
        below += [child, *_descendants(child)]
    return below


def _cpu_s(pid: int) -> float:
    """Return the CPU seconds of a process and of its children that were waited for; 0 if it has ended."""
    with suppress(FileNotFoundError, ProcessLookupError):
        # The name of the program, in brackets, may hold anything.
        words = Path(f"/proc/{pid}/stat").read_text(errors="replace").rpartition(")")[2].split()
        return sum(map(int, words[11:15])) / os.sysconf("SC_CLK_TCK")
    return 0.0


def _stands_still(pid: int) -> bool:
    """Return whether all threads of a process are stopped or have ended."""
    with suppress(FileNotFoundError, ProcessLookupError):
        for thread in os.listdir(f"/proc/{pid}/task"):
            with suppress(FileNotFoundError, ProcessLookupError):
                status = Path(f"/proc/{pid}/task/{thread}/stat").read_text(errors="replace")
                if status.rpartition(")")[2].split()[0] not in "TtZX":
                    return False
    return True


def _children(pid: int) -> list[int]:
    """Return the children of a process; every thread may have some."""
    children = []
    # A process, and each of its threads, may have ended meanwhile.
    with suppress(FileNotFoundError, ProcessLookupError):
        for thread in os.listdir(f"/proc/{pid}/task"):
            with suppress(FileNotFoundError, ProcessLookupError):
                children += Path(f"/proc/{pid}/task/{thread}/children").read_text().split()
    return [int(word) for word in children]
