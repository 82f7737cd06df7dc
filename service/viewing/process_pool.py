"""The processes that make pictures on demand, so that requests share neither Python's lock nor their memory with them.

A process starts with the first picture, or with the description of the views that a viewer asks for first. It keeps the
sheets that it has read, and ends when nobody has asked for a picture for a while.

| a picture | the request is answered with | the process |
|---|---|---|
| takes longer than `timeout_s` | 503 | is killed |
| needs more memory than `memory_bytes` | 422 | is killed |
| is being made when its process dies | 503 | is replaced at the next picture |
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import structlog

from lippmann.errors import ArtifactBroken, FieldProblem, LippmannError
from lippmann.plan.artifact_store import ArtifactStore
from service.errors import Invalid, PictureFailed, ServiceError
from service.ports import Parts, Pictures
from service.viewing import picture_process as child
from service.viewing.render import Wanted

NICENESS = 10
"""The niceness of the processes that make pictures; that of the service is 0."""
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


class ProcessPool:
    """Makes pictures in processes; for any number of threads, of which at most `places` make pictures at once."""

    def __init__(self, parts: Parts, limits: ProcessLimits) -> None:
        self._parts = parts
        self._limits = limits
        self._free: list[_Process] = []
        """The processes that make no picture; the one that was used last stands last."""
        self._all: set[_Process] = set()
        self._lock = threading.RLock()
        self._is_closed = False
        # The kernel kills a process when the thread that started it ends, so all are started by one that stays.
        self._starter = ThreadPoolExecutor(1, "picture-processes")

    def make(self, wanted: Wanted) -> bytes:
        """Return the file that is wanted.

        Raises
        ------
        PictureFailed
            If the picture took too long, or its process died.
        Invalid
            If the picture needs too much memory.
        ArtifactMissing, ArtifactBroken
            If its sheet was deleted in the meantime, or cannot be read.
        """
        with self._taken(wanted.sheet_name) as process:
            return process.make(wanted, self._parts.store)

    def warm_up(self) -> None:
        """Start a process if there is none, and do not wait for it."""
        with self._lock:
            if not (self._is_closed or self._all):
                self._starter.submit(self._start_first)

    def end_idle(self) -> None:
        """End the processes that nobody has needed for a while, and those that have died."""
        now_s = time.monotonic()
        with self._lock:
            ended = [one for one in self._free if one.has_died() or now_s - one.used_s >= self._limits.idle_s]
            self._free = [one for one in self._free if one not in ended]
            self._all -= set(ended)
        for process in ended:
            process.end()

    def close(self) -> None:
        """End all processes; the pictures that are being made fail."""
        with self._lock:
            self._is_closed = True
            free, self._free = self._free, []
            self._all -= set(free)
            busy = list(self._all)
        for process in free:
            process.end()
        for process in busy:
            process.kill()  # The thread that waits for its picture ends it.
        self._starter.shutdown()

    @property
    def pids(self) -> list[int]:
        """The ids of the processes."""
        with self._lock:
            return [process.pid for process in self._all]

    @contextmanager
    def _taken(self, sheet_name: str) -> Iterator[_Process]:
        process = self._take_free(sheet_name) or self._take_new(sheet_name)
        try:
            yield process
        finally:
            with self._lock:
                stays = process.is_in_step and not self._is_closed
                if stays:
                    process.used_s = time.monotonic()
                    self._free.append(process)
                else:
                    self._all.discard(process)
            if not stays:
                process.end()

    def _take_free(self, sheet_name: str) -> _Process | None:
        """Take a process that has read the sheet last, or else the one that was used last."""
        with self._lock:
            for process in [one for one in self._free if one.has_died()]:
                self._free.remove(process)
                self._all.discard(process)
                process.end()
            if not self._free:
                return None
            known = (one for one in reversed(self._free) if one.sheet_name == sheet_name)
            process = next(known, self._free[-1])
            self._free.remove(process)
            process.sheet_name = sheet_name
            return process

    def _take_new(self, sheet_name: str) -> _Process:
        with self._lock:
            if self._is_closed:
                raise PictureFailed("the service stops")
            started = self._starter.submit(self._take_or_start, sheet_name)
        return started.result()

    def _take_or_start(self, sheet_name: str) -> _Process:
        with self._lock:
            return self._take_free(sheet_name) or self._start(sheet_name)

    def _start_first(self) -> None:
        with self._lock:
            if not self._all:
                self._free.append(self._start(""))

    def _start(self, sheet_name: str) -> _Process:
        if self._is_closed:
            raise PictureFailed("the service stops")
        try:
            process = _Process(self._parts.pictures, self._limits)
        except OSError as error:
            raise PictureFailed(f"no process can be started to make the picture: {error.strerror}") from error
        process.sheet_name = sheet_name
        self._all.add(process)
        return process


class _Process:
    """A process that makes pictures, one after the other."""

    def __init__(self, pictures: Pictures, limits: ProcessLimits) -> None:
        self.sheet_name = ""
        """The sheet of its last picture."""
        self.used_s = time.monotonic()
        self.is_in_step = True
        """False from a request until its answer has come, so a process that failed is not used again."""
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
        _restrain(self.pid, limits.memory_bytes)
        with suppress(OSError):  # A process that has died already is found by the request.
            self._connection.send((pictures, limits.room_bytes // limits.places))

    def make(self, wanted: Wanted, store: ArtifactStore) -> bytes:
        self.is_in_step = False
        timer = threading.Timer(self._limits.timeout_s, self._end_late)
        timer.daemon = True
        timer.start()
        try:
            with ExitStack() as paths:
                return self._answered(wanted, store, paths)
        finally:
            timer.cancel()

    def has_died(self) -> bool:
        return self._process.poll() is not None

    def kill(self) -> None:
        self._process.kill()

    def end(self) -> None:
        self.kill()
        self._process.wait()
        self._connection.close()

    def _answered(self, wanted: Wanted, store: ArtifactStore, paths: ExitStack) -> bytes:
        self._send(wanted)
        while True:
            answer = self._receive()
            kind, content = answer[: child.KIND_BYTES], answer[child.KIND_BYTES :]
            if kind == child.PATH:
                self._send(self._path(wanted.sheet_name, store, paths))
                continue
            if kind == child.TOO_LARGE:
                raise _too_large(self._limits.memory_bytes)
            self.is_in_step = True
            if kind == child.PICTURE:
                return content
            raise _error(json.loads(content))

    def _path(self, name: str, store: ArtifactStore, paths: ExitStack) -> Path:
        try:
            return paths.enter_context(store.local_path(name))
        except LippmannError:
            self._send(None)
            self.is_in_step = True
            raise

    def _send(self, message: Any) -> None:
        try:
            self._connection.send(message)
        except ConnectionError as error:
            raise self._failure() from error

    def _receive(self) -> bytes:
        try:
            return self._connection.recv_bytes(MOST_BYTES)
        except (EOFError, OSError) as error:
            raise self._failure() from error

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


def _restrain(pid: int, memory_bytes: int) -> None:
    with suppress(ProcessLookupError):
        os.setpriority(os.PRIO_PROCESS, pid, NICENESS)
        resource.prlimit(pid, resource.RLIMIT_AS, (memory_bytes, memory_bytes))
        resource.prlimit(pid, resource.RLIMIT_CORE, (0, 0))
    with suppress(OSError):  # Some containers do not allow it.
        Path(f"/proc/{pid}/oom_score_adj").write_text(str(FIRST_KILLED))


def _too_large(memory_bytes: int) -> Invalid:
    expected = f"a picture that is made in {memory_bytes / 1e6:.0f} MB (LIPPMANN_PICTURE_MEMORY_MB)"
    problem = FieldProblem(field="frame", expected=expected, got="a larger one")
    return Invalid(str(problem), problems=[problem])


def _error(told: dict[str, Any]) -> ServiceError | LippmannError:
    """Return the error that a process told."""
    if "trace" in told:
        log.error("a picture failed", trace=told["trace"])
        return ServiceError()
    if told["code"] == ArtifactBroken.code:
        return ArtifactBroken(told["message"])
    error = ServiceError(told["message"], problems=[FieldProblem(**problem) for problem in told["problems"]])
    error.code = told["code"]
    return error
