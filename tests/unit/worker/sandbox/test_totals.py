"""The totals of a task: its files, also those without a name, its memory and its processes."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from worker.sandbox.ending import Ending
from worker.sandbox.limits import Limits
from worker.sandbox.totals import find_excess

LIMITS = Limits(cpu_s=10, memory_mb=4096, disk_mb=4, files=10, processes=64)
MIB = 1024 * 1024


def _message(folder: Path, limits: Limits = LIMITS, pids: tuple[int, ...] = ()) -> str:
    excess = find_excess(folder, pids, limits)
    return excess.message if excess else ""


def test_a_task_within_its_limits_exceeds_nothing(tmp_path: Path) -> None:
    for number in range(10):
        (tmp_path / str(number)).write_bytes(bytes(1000))
    assert find_excess(tmp_path, [], LIMITS) is None


def test_files_and_folders_are_counted_in_all_depths(tmp_path: Path) -> None:
    (tmp_path / "a" / "b" / "c" / "d" / "e" / "f" / "g" / "h" / "i" / "j").mkdir(parents=True)
    assert _message(tmp_path) == ""
    (tmp_path / "a" / "b" / "one more").write_bytes(b"")
    assert "more than 10 files" in _message(tmp_path)


def test_bytes_on_the_disk_are_counted_and_holes_are_not(tmp_path: Path) -> None:
    with (tmp_path / "holes").open("wb") as file:
        file.truncate(100 * MIB)
    assert _message(tmp_path) == ""
    (tmp_path / "full").write_bytes(b"x" * 5 * MIB)
    assert "5 MB; the limit is 4 MB" in _message(tmp_path)


@contextmanager
def _running(code: str, folder: Path) -> Iterator[int]:
    process = subprocess.Popen([sys.executable, "-c", f"{code}\nprint(flush=True)\ninput()"], cwd=folder,
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE)  # fmt: skip
    with process:
        assert process.stdout is not None
        process.stdout.readline()
        yield process.pid
        process.kill()


def test_a_removed_file_counts_while_it_is_open(tmp_path: Path) -> None:
    code = "import os; f = open('gone', 'wb'); f.write(b'x' * 5 * 2**20); f.flush(); os.remove('gone')"
    with _running(code, tmp_path) as pid:
        assert _message(tmp_path) == ""
        assert "5 MB; the limit is 4 MB" in _message(tmp_path, pids=(pid,))


def test_a_task_never_has_more_than_what_is_left_for_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "full").write_bytes(b"x" * 66 * MIB)
    large = replace(LIMITS, disk_mb=1000)
    for free_mb, holds in ((67, True), (65, False), (0, False)):
        disk = SimpleNamespace(f_bavail=free_mb * 256, f_frsize=4096, f_files=0)
        monkeypatch.setattr(os, "statvfs", lambda _, disk=disk: disk)
        assert (_message(tmp_path, large) == "") is holds
    (tmp_path / "full").write_bytes(b"x" * MIB)
    assert _message(tmp_path, large) == "", "a full disk is no fault of a small task"


@pytest.mark.parametrize(("free", "holds"), [(61, True), (59, False), (0, False)])
def test_a_task_never_has_more_files_than_the_disk_can_still_have(
    free: int, holds: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in range(60):
        (tmp_path / str(number)).touch()
    disk = SimpleNamespace(f_bavail=2**20, f_frsize=4096, f_files=1000, f_favail=free)
    monkeypatch.setattr(os, "statvfs", lambda _: disk)
    assert (_message(tmp_path, replace(LIMITS, files=1000)) == "") is holds


def test_memory_of_all_processes_and_their_threads_have_limits(tmp_path: Path) -> None:
    code = "import threading; b = b'x' * 60 * 2**20; [threading.Thread(target=input).start() for _ in range(20)]"
    with _running(code, tmp_path) as first, _running(code, tmp_path) as second:
        assert find_excess(tmp_path, [first], replace(LIMITS, memory_mb=120)) is None
        excess = find_excess(tmp_path, [first, second], replace(LIMITS, memory_mb=120))
        assert excess is not None
        assert excess.ending is Ending.TOO_MUCH_MEMORY
        assert "processes and threads" in _message(tmp_path, replace(LIMITS, processes=20), (first, second))
        assert _message(tmp_path, replace(LIMITS, processes=20), (first,)) == ""


def test_a_process_that_has_ended_counts_for_nothing(tmp_path: Path) -> None:
    assert find_excess(tmp_path, [2**22 + 1], LIMITS) is None
