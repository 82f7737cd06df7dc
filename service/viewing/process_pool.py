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

import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from service.errors import PictureFailed
from service.ports import Parts
from service.viewing.process_handle import Process, ProcessLimits
from service.viewing.render import Wanted


class ProcessPool:
    """Makes pictures in processes; for any number of threads, of which at most `places` make pictures at once."""

    def __init__(self, parts: Parts, limits: ProcessLimits) -> None:
        self._parts = parts
        self._limits = limits
        self._free: list[Process] = []
        """The processes that make no picture; the one that was used last stands last."""
        self._all: set[Process] = set()
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
        """Start a process unless one runs, and do not wait for it."""
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
    def _taken(self, sheet_name: str) -> Iterator[Process]:
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

    def _take_free(self, sheet_name: str) -> Process | None:
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

    def _take_new(self, sheet_name: str) -> Process:
        with self._lock:
            if self._is_closed:
                raise PictureFailed("the service stops")
            started = self._starter.submit(self._take_or_start, sheet_name)
        return started.result()

    def _take_or_start(self, sheet_name: str) -> Process:
        with self._lock:
            return self._take_free(sheet_name) or self._start(sheet_name)

    def _start_first(self) -> None:
        with self._lock:
            if not self._all:
                self._free.append(self._start(""))

    def _start(self, sheet_name: str) -> Process:
        if self._is_closed:
            raise PictureFailed("the service stops")
        try:
            process = Process(self._parts.pictures, self._limits)
        except OSError as error:
            raise PictureFailed(f"no process can be started to make the picture: {error.strerror}") from error
        process.sheet_name = sheet_name
        self._all.add(process)
        return process
