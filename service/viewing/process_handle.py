"""One process that makes pictures, as the service sees it."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import structlog

from lippmann.errors import ArtifactBroken, FieldProblem, LippmannError
from lippmann.plan.artifact_store import ArtifactStore
from service.errors import Invalid, PictureFailed, ServiceError
from service.ports import Pictures
from service.viewing import picture_process as child
from service.viewing.render import Wanted

FIRST_KILLED = 1000
"""The oom_score_adj of the processes: when the machine has no memory left, the kernel ends them and not the service."""
MOST_BYTES = 1 << 30
"""The largest file that a process may send."""
PASSED = ("PATH", "LANG", "LC_ALL", "LD_LIBRARY_PATH", "TMPDIR", "TZ")
"""The environment that the processes inherit. That of the service has passwords."""

log = structlog.get_logger("service.pictures")


@dataclass(frozen=True)
class ProcessLimits:
    """The limits of the processes that make pictures."""

    places: int
    """The largest number of processes."""
    room_bytes: int
    """The memory for sheets, of all processes together."""
    memory_bytes: int
    """The address space of a process."""
    timeout_s: float
    """The longest time of a picture."""
    idle_s: float
    """The time without a picture after which a process ends."""


class Process:
    """A process that makes pictures, one after the other."""

    def __init__(self, pictures: Pictures, limits: ProcessLimits) -> None:
        self.sheet_name = ""
        """The sheet of its last picture."""
        self.used_s = time.monotonic()
        self.is_in_step = True
        """False from a request until a whole answer has come in time, so a process that failed is not used again."""
        self._limits = limits
        self._is_late = False
        self._connection, theirs = Pipe()
        with theirs:
            # The group of its own keeps Ctrl-C from it, which the service handles.
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", child.__name__, str(theirs.fileno()), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env=_environment(),
                pass_fds=(theirs.fileno(),),
                process_group=0,
            )
        self.pid = self._process.pid
        try:
            self._memory_bytes = _restrain(self.pid, limits.memory_bytes)
        except OSError:
            self.end()
            raise
        with suppress(OSError):  # A process that has died already is found by the request.
            self._connection.send((pictures, limits.room_bytes // limits.places))

    def make(self, wanted: Wanted, store: ArtifactStore) -> bytes:
        """Return the file that is wanted, whose sheet is in a store; the errors are those of the pool."""
        self.is_in_step = False
        timer = threading.Timer(self._limits.timeout_s, self._end_late)
        timer.daemon = True
        timer.start()
        try:
            with ExitStack() as paths:
                return self._answered(wanted, store, paths)
        finally:
            timer.cancel()
            timer.join()
            if self._is_late:  # It may have answered just before it was killed.
                self.is_in_step = False

    def has_died(self) -> bool:
        """Return whether the process has ended."""
        return self._process.poll() is not None

    def kill(self) -> None:
        """Kill the process; the picture that it is making fails."""
        self._process.kill()

    def end(self) -> None:
        """Kill the process while it makes no picture, and wait for its end."""
        self.kill()
        self._process.wait()
        self._connection.close()

    def _answered(self, wanted: Wanted, store: ArtifactStore, paths: ExitStack) -> bytes:
        self._send(wanted)
        kind, content = self._receive()
        if kind == child.PATH:  # A picture has one sheet, whose path is asked for once.
            self._send(self._path(wanted.sheet_name, store, paths))
            kind, content = self._receive()
        if kind == child.TOO_LARGE:
            raise _too_large(self._memory_bytes, is_setting=self._memory_bytes == self._limits.memory_bytes)
        if kind == child.PICTURE:
            self.is_in_step = True
            return content
        try:
            told = _error(kind, content)
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise self._failure() from error
        self.is_in_step = True
        raise told

    def _path(self, name: str, store: ArtifactStore, paths: ExitStack) -> Path:
        try:
            return paths.enter_context(store.local_path(name))
        except (LippmannError, OSError) as error:
            self._send(None)
            self.is_in_step = True
            if isinstance(error, OSError):
                reason = error.strerror or type(error).__name__
                raise PictureFailed(f"the sheet of the picture cannot be read: {reason}") from error
            raise

    def _send(self, message: Any) -> None:
        try:
            self._connection.send(message)
        except ConnectionError as error:
            raise self._failure() from error

    def _receive(self) -> tuple[bytes, bytes]:
        """Return what an answer is, and its content."""
        try:
            answer = self._connection.recv_bytes(MOST_BYTES)
        except (EOFError, OSError) as error:
            raise self._failure() from error
        return answer[: child.KIND_BYTES], answer[child.KIND_BYTES :]

    def _end_late(self) -> None:
        self._is_late = True
        self.kill()

    def _failure(self) -> PictureFailed:
        self.kill()
        code = self._process.wait()
        reason = f"by {signal.Signals(-code).name}" if code < 0 else f"with the exit code {code}"
        log.warning("a process that made a picture ended", ended=reason, late=self._is_late)
        if self._is_late:
            return PictureFailed(f"the picture took longer than {self._limits.timeout_s:g} s and was given up")
        return PictureFailed(f"the process that made the picture ended {reason}")


def _environment() -> dict[str, str]:
    passed = {name: os.environ[name] for name in PASSED if name in os.environ}
    # The process imports what the service imports. One core is its share, for matrix products too.
    return {**passed, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "OPENBLAS_NUM_THREADS": "1"}


def _restrain(pid: int, memory_bytes: int) -> int:
    """Limit what a process may take, and return its address space, which is smaller if the service has a limit."""
    with suppress(ProcessLookupError):
        _, hard = resource.prlimit(pid, resource.RLIMIT_AS)
        memory_bytes = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
        resource.prlimit(pid, resource.RLIMIT_AS, (memory_bytes, memory_bytes))
        resource.prlimit(pid, resource.RLIMIT_CORE, (0, 0))
    with suppress(OSError):  # Some containers do not allow it.
        Path(f"/proc/{pid}/oom_score_adj").write_text(str(FIRST_KILLED))
    return memory_bytes


def _too_large(memory_bytes: int, *, is_setting: bool) -> Invalid:
    limit = "LIPPMANN_PICTURE_MEMORY_MB" if is_setting else "the limit of the address space of the service"
    expected = f"a picture that is made in {memory_bytes / 1e6:.0f} MB ({limit})"
    problem = FieldProblem(field="frame", expected=expected, got="a larger one")
    return Invalid(str(problem), problems=[problem])


def _error(kind: bytes, content: bytes) -> ServiceError | LippmannError:
    """Return the error that a process told; raise another one if the process told none."""
    if kind != child.PROBLEM:
        raise ValueError(f"expected {child.PROBLEM!r}, got {kind!r}")
    told = json.loads(content)
    if "trace" in told:
        log.error("a picture failed", trace=told["trace"])
        return ServiceError()
    if told["code"] == ArtifactBroken.code:
        return ArtifactBroken(told["message"])
    error = ServiceError(told["message"], problems=[FieldProblem(**problem) for problem in told["problems"]])
    error.code = told["code"]
    return error
