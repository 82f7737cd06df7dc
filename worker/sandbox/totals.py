"""Totals of a running task: its files together, its memory together, its processes.

No limit of the kernel covers the files, and memory and processes only where each task has a cgroup (`groups`).

They are counted several times a second, and a task that exceeds one is ended. A program can be faster than the count,
but only for a fraction of a second: the totals bound what a task may keep, and the limits of the kernel bound what one
file and one process may take.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Iterable, Iterator
from pathlib import Path

from worker.sandbox.ending import Ending, Excess
from worker.sandbox.limits import Limits

ALWAYS_ALLOWED_BYTES = 64 * 1024 * 1024
"""The bytes that a task may have on a disk that is nearly full."""

ALWAYS_ALLOWED_FILES = 50
"""The files that a task may have on a disk that has nearly as many as it can."""

OUR_PROCESSES = 8
"""The processes of the sandbox itself."""

_BLOCK_BYTES = 512
_MIB = 1024 * 1024
_PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


def find_excess(folder: Path, pids: Iterable[int], limits: Limits) -> Excess | None:
    """Return the total that a task exceeds, or None.

    Parameters
    ----------
    folder
        The folder that the task can write.
    pids
        All processes of the task.
    """
    pids = list(pids)
    threads = sum(map(_threads, pids))
    if threads > limits.processes + OUR_PROCESSES:
        return Excess(f"it has {threads} processes and threads; the limit is {limits.processes}")
    memory = sum(map(_resident_bytes, pids))
    if memory > limits.memory_mb * _MIB:
        message = f"its processes together have {memory // _MIB} MB of memory; the limit is {limits.memory_mb} MB"
        return Excess(message, ending=Ending.TOO_MUCH_MEMORY)
    files, size = _usage(folder, pids, most_files=limits.files)
    if files > limits.files:
        return Excess(f"it has more than {limits.files} files, which is the limit")
    disk = os.statvfs(folder)
    if disk.f_files and files > max(disk.f_favail, ALWAYS_ALLOWED_FILES):
        return Excess(f"it has {files} files, more than the disk can still have beside them")
    # Half of what the disk had for it: however many such tasks there are, they never fill it.
    room = max(disk.f_bavail * disk.f_frsize, ALWAYS_ALLOWED_BYTES)
    if size > room:
        return Excess(f"its files have {size // _MIB} MB, more than the room that is left beside them")
    if size > limits.disk_mb * _MIB:
        return Excess(f"its files have {size // _MIB} MB; the limit is {limits.disk_mb} MB")
    return None


def _usage(folder: Path, pids: Iterable[int], *, most_files: int) -> tuple[int, int]:
    """Return the number of files of a task and their bytes on the disk; counting stops above `most_files`."""
    files, size = 0, 0
    for status in _statuses(folder):
        files += 1
        size += status.st_blocks * _BLOCK_BYTES
        if files > most_files:
            return files, size
    removed = {(status.st_dev, status.st_ino): status for pid in pids for status in _removed_files(pid)}
    return files + len(removed), size + sum(status.st_blocks for status in removed.values()) * _BLOCK_BYTES


def _statuses(folder: Path) -> Iterator[os.stat_result]:
    """Yield the status of every file and folder below a folder; what vanishes meanwhile is left out."""
    folders = [os.fspath(folder)]
    while folders:
        try:
            with os.scandir(folders.pop()) as entries:
                for entry in entries:
                    status = entry.stat(follow_symlinks=False)
                    if stat.S_ISDIR(status.st_mode):
                        folders.append(entry.path)
                    yield status
        except OSError:
            continue


def _removed_files(pid: int) -> Iterator[os.stat_result]:
    """Yield the files that a process has open although they have no name any more."""
    try:
        descriptors = os.listdir(f"/proc/{pid}/fd")
    except OSError:
        return
    for descriptor in descriptors:
        try:
            status = os.stat(f"/proc/{pid}/fd/{descriptor}")
        except OSError:
            continue
        if stat.S_ISREG(status.st_mode) and status.st_nlink == 0:
            yield status


def _threads(pid: int) -> int:
    try:
        return len(os.listdir(f"/proc/{pid}/task"))
    except OSError:
        return 0


def _resident_bytes(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * _PAGE_BYTES
    except OSError:
        return 0
