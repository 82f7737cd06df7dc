"""An engine that was taken over reads nothing, writes nothing, fills nothing and leaves nothing."""

from __future__ import annotations

import json
import os
import resource
import signal
from dataclasses import replace
from pathlib import Path

import pytest

import service
import worker
from lippmann.errors import RenderFailed
from tests.security.conftest import LIMITS, Task
from worker.engines.povray.answers.diagnosis import signal_of
from worker.sandbox.ending import Ending
from worker.sandbox.process import Outcome
from worker.sandbox.results import take_result

MIB = 1024 * 1024


def _printed(outcome: Outcome[int]) -> list[str]:
    assert (outcome.ending, outcome.exit_code) == (Ending.EXITED, 0), outcome.lines
    printed: list[str] = json.loads(outcome.lines[-1])
    return printed


@pytest.fixture
def treasures(task: Task) -> list[Path]:
    """Return what a task must not reach: a key, a database, other tasks and scenes, our source, the machine's files."""
    made = [task.outside / name for name in ("admin.key", "lippmann.db", "attempts/other/tile.exr", "bundles/b/a.inc")]
    for path in made:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"secret")
        path.chmod(0o666)
    return made


@pytest.mark.promise("Scenes", "A program that has taken over the engine reads nothing of the machine.")
def test_it_reads_nothing_of_the_machine(task: Task, treasures: list[Path]) -> None:
    sources = [Path(str(package.__file__)) for package in (service, worker)]
    of_process = [Path(f"/proc/{pid}/{name}") for pid in (1, os.getpid(), "self") for name in ("environ", "cmdline")]
    system = [Path(name) for name in ("/etc/passwd", "/etc/shadow", "/etc/hostname", "/proc", "/sys", "/var", "/run")]
    wanted = [*treasures, task.outside, *sources, *of_process, *system]
    assert _printed(task.run("reads", *map(str, wanted))) == []
    assert _printed(task.run("reads", "/usr/bin/env")) == ["/usr/bin/env"], "the attack works where it may"


@pytest.mark.promise("Scenes", "It writes nothing outside its folder.")
def test_it_writes_nothing_outside_its_folder(task: Task, treasures: list[Path]) -> None:
    named = [str(path) for path in (*treasures, Path("/usr/bin/env"), Path(worker.__file__), task.outside / "new")]
    named += [f"{folder}/new" for folder in ("", "/dev", "/dev/shm", "/tmp", "/var/tmp", "/usr", "/run", "/proc/self")]
    before = {path: path.stat() for path in treasures}
    assert _printed(task.run("writes", *named)) == []
    assert {path: path.stat() for path in treasures} == before
    (task.work / "own").write_bytes(b"")
    assert "write own" in _printed(task.run("writes", "own")), "the attack works where it may"


@pytest.mark.promise("Scenes", "It makes no socket of any kind.")
def test_it_makes_no_socket_of_any_kind(task: Task) -> None:
    assert _printed(task.run("sockets")) == []


@pytest.mark.promise("Scenes", "It leaves no link, and nothing of it is taken.")
def test_it_leaves_no_link_and_nothing_of_it_is_taken(task: Task, treasures: list[Path]) -> None:
    assert _printed(task.run("leftovers", str(treasures[0]), "tile.exr")) == []
    assert take_result(task.work, "tile.exr", into=task.outside, max_bytes=1000) is None
    os.mkdir(task.work / "tile.exr")
    with pytest.raises(RenderFailed, match="a folder"):
        take_result(task.work, "tile.exr", into=task.outside, max_bytes=1000)


FILLS = {
    "fill_bytes": "MB; the limit is 32 MB",
    "fill_removed": "MB; the limit is 32 MB",
    "fill_inodes": "more than 500 files",
    "fill_depth": "more than 500 files",
}


@pytest.mark.promise("Scenes", "What fills the disk ends its own task only.")
@pytest.mark.parametrize("attack", FILLS)
def test_what_fills_the_disk_ends_its_own_task(task: Task, attack: str) -> None:
    outcome = task.run(attack)
    assert outcome.ending is Ending.TOO_MUCH
    assert FILLS[attack] in outcome.excess


@pytest.mark.promise("Scenes", "Memory ends its own task only, however many processes take it.")
def test_memory_ends_its_own_task_however_many_processes_take_it(task: Task) -> None:
    outcome = task.run("fill_memory", limits=replace(LIMITS, memory_mb=300))
    if task.sandbox.mode == "bwrap":
        assert outcome.ending is Ending.TOO_MUCH_MEMORY
    else:
        assert (outcome.ending, outcome.exit_code) == (Ending.EXITED, 1)
        assert "MemoryError" in outcome.lines
    # Linux counts the memory of the process that starts a program as some of the program, and pytest may be large.
    own_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    assert outcome.peak_memory_mb < max(400, own_mb + 1)


@pytest.mark.promise("Scenes", "Processes and threads have a limit.")
def test_processes_and_threads_have_a_limit(task: Task) -> None:
    outcome = task.run("fill_processes", limits=replace(LIMITS, cpu_s=2, processes=20, memory_mb=4096))
    # Where the kernel counts them, it refuses more, and the attack ends with its CPU time.
    ended_by_kernel = (outcome.ending, signal_of(outcome.exit_code)) == (Ending.EXITED, signal.SIGXCPU)
    assert outcome.ending is Ending.TOO_MUCH or ended_by_kernel


@pytest.mark.promise("Scenes", "No process outlives its task.")
def test_no_process_escapes_its_end(task: Task) -> None:
    outcome = task.run("escapes_its_end")
    assert (outcome.ending, outcome.exit_code) == (Ending.EXITED, 0)
