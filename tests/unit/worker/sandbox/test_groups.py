"""The cgroups of tasks: real ones where some were given to the tests, which `LIPPMANN_TEST_CGROUP` names."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from lippmann.errors import SandboxMissing
from tests.waiting import until
from worker.sandbox import groups as sandbox_groups
from worker.sandbox.detect import detect
from worker.sandbox.ending import Ending
from worker.sandbox.groups import Groups, NoGroups, TaskGroup, find_groups, own_group
from worker.sandbox.limits import Limits, TimeLimit, TimeLimits
from worker.sandbox.log import AttemptLog
from worker.sandbox.process import run
from worker.sandbox.sandbox import Sandbox

LIMITS = Limits(cpu_s=60, memory_mb=100, processes=10)
BOMB = """
import os, sys, time
for _ in range(4):
    if os.fork() == 0:
        kept = bytes(1) * 60 * 2**20
        time.sleep(600)
os.wait()
time.sleep(600)
"""
"""Four processes, each of which takes less than the limit."""
FORKS = """
import os, time
count = 0
try:
    while count < 100:
        if os.fork() == 0:
            os.closerange(0, 3)
            time.sleep(600)
        count += 1
except OSError:
    print(count, flush=True)
"""


@pytest.fixture
def groups() -> Groups:
    """Return the place of real groups."""
    found = find_groups(os.environ.get("LIPPMANN_TEST_CGROUP", "auto"))
    if isinstance(found, NoGroups):
        pytest.skip(f"needs a cgroup for the groups of tasks, which LIPPMANN_TEST_CGROUP names: {found.reason}")
    return found


def _run(group: TaskGroup, program: str) -> subprocess.CompletedProcess[str]:
    argv = group.entering([sys.executable, "-I", "-S", "-c", program])
    return subprocess.run(argv, capture_output=True, text=True, timeout=120)


def _left(groups: Groups) -> list[Path]:
    return [group for folder in groups.folders for group in folder.glob("lippmann-task-*")]


@pytest.mark.promise(
    "Scenes", "Where a sandbox holds and the worker has a cgroup, the kernel limits the memory of a whole task."
)
def test_the_kernel_ends_processes_that_together_have_more_memory_than_the_task_may(groups: Groups) -> None:
    with groups.task(LIMITS) as group:
        began_s = time.monotonic()
        if (group.folders[0] / "memory.oom.group").exists():
            assert _run(group, BOMB).returncode < 0, "all of them, not one of the four"
        else:
            _await_first_kill(group)
        assert group.ran_out_of_memory()
        assert time.monotonic() - began_s < 100
    assert _left(groups) == []


def _await_first_kill(group: TaskGroup) -> None:
    """In cgroup v1, the kernel kills one process at a time."""
    with subprocess.Popen(group.entering([sys.executable, "-I", "-S", "-c", BOMB])) as ran:
        until(group.ran_out_of_memory)
        ran.kill()


def test_a_task_within_its_limits_ends_as_it_wants(groups: Groups) -> None:
    with groups.task(LIMITS) as group:
        assert _run(group, "print(2)").stdout == "2\n"
        assert (group.cpu_s() > 0) is (group.folders[0] / "cpu.stat").exists()
        assert not group.ran_out_of_memory()


def test_a_kill_because_the_group_above_has_no_memory_is_not_the_limit_of_the_task(groups: Groups) -> None:
    above = groups.folders[0] / "above"
    if not (above.parent / "cgroup.controllers").exists():
        pytest.skip("needs cgroup v2")
    above.mkdir()
    try:
        (above / "cgroup.subtree_control").write_text("+memory")
        (above / "memory.max").write_text(str(60 * 2**20))
        with Groups((above,)).task(LIMITS) as group:
            assert _run(group, BOMB).returncode < 0
            assert "oom_kill 0" not in (group.folders[0] / "memory.events").read_text()
            assert not group.ran_out_of_memory()
    finally:
        above.rmdir()


def test_a_run_out_of_memory_is_told_as_the_limit_of_memory(groups: Groups, tmp_path: Path) -> None:
    limit = TimeLimit(120, "the test")
    with AttemptLog(tmp_path / "log.txt") as log:
        outcome = run(
            [sys.executable, "-I", "-S", "-c", BOMB],
            cwd=tmp_path,
            env={},
            times=TimeLimits(total=limit, stall=limit),
            reader=_Silent(),
            on_progress=lambda _: None,
            should_stop=lambda: False,
            log=log,
            limits=LIMITS,
            groups=groups,
        )
    assert outcome.ending is Ending.TOO_MUCH_MEMORY
    assert "the limit is 100 MB" in outcome.excess
    assert _left(groups) == []


class _Silent:
    progress, phase, growth = 0, "working", 0.0

    def read(self, line: str) -> bool:
        return False


def test_a_group_has_a_limit_of_processes(groups: Groups) -> None:
    with groups.task(LIMITS) as group:
        if not any((folder / "pids.max").exists() for folder in group.folders):
            pytest.skip("needs the controller of processes")
        assert 5 < int(_run(group, FORKS).stdout.split()[-1]) < 20
    assert _left(groups) == [], "also with processes in it"


SERVICE = """
from worker.sandbox.groups import find_groups, make_room, own_group
from worker.sandbox.limits import Limits
before, nothing = own_group(), find_groups("auto")
make_room()
with find_groups("auto").task(Limits(cpu_s=1, memory_mb=9)) as group:
    print(nothing.reason, own_group() == before / "lippmann-worker", group.folders[0].parent == before, sep=";")
"""


def test_a_worker_makes_room_in_the_group_that_systemd_has_delegated_to_it(groups: Groups) -> None:
    service = groups.folders[0] / "service"
    if not (service.parent / "cgroup.controllers").exists():
        pytest.skip("needs cgroup v2")
    service.mkdir()
    try:
        os.setxattr(service, "user.delegate", b"1")
        argv = TaskGroup((service,)).entering([sys.executable, "-c", SERVICE])
        ran = subprocess.run(argv, capture_output=True, text=True, timeout=120)
        assert ran.stdout == "the worker is in no cgroup that was delegated to it;True;True\n", ran.stderr
    finally:
        for group in (service / "lippmann-worker", service):
            group.rmdir()


CONTAINER = """
from worker.sandbox.groups import make_room, own_group
make_room()
print(own_group())
"""


def test_the_group_of_a_container_stays_as_it_is(groups: Groups) -> None:
    container = groups.folders[0] / "container"
    if not (container.parent / "cgroup.controllers").exists():
        pytest.skip("needs cgroup v2")
    container.mkdir()
    try:
        os.setxattr(container, "user.delegate", b"1")
        inside = 'umount -l /sys/fs/cgroup; mount -t cgroup2 cgroup /sys/fs/cgroup && exec "$@"'
        argv = ["unshare", "-C", "-m", "sh", "-c", inside, "sh", sys.executable, "-c", CONTAINER]
        entering = TaskGroup((container,)).entering(argv)
        ran = subprocess.run(entering, capture_output=True, text=True, timeout=120)
        assert ran.stdout == "/sys/fs/cgroup\n", ran.stderr
        assert not (container / "lippmann-worker").exists()
    finally:
        container.rmdir()


def test_groups_of_workers_that_have_ended_are_removed(tmp_path: Path) -> None:
    groups = Groups((tmp_path,))
    ended = subprocess.Popen(["/bin/true"])
    ended.wait()
    boot, namespace = Path("/proc/sys/kernel/random/boot_id").read_text()[:8], os.stat("/proc/self/ns/pid").st_ino
    stale = f"lippmann-task-{boot}-{namespace}-{ended.pid}-aa"
    kept = {
        f"lippmann-task-{boot}-{namespace}-{os.getpid()}-aa",
        f"lippmann-task-{boot}-{namespace + 1}-{ended.pid}-aa",
        f"lippmann-task-00000000-{namespace}-{ended.pid}-aa",
    }
    try:
        for name in (stale, *kept):
            (groups.folders[0] / name).mkdir()
        groups.remove_stale()
        assert {group.name for group in _left(groups)} == kept
    finally:
        for group in _left(groups):
            group.rmdir()


def test_a_folder_that_is_no_group_is_refused(tmp_path: Path) -> None:
    with pytest.raises(SandboxMissing, match=f"LIPPMANN_CGROUP: expected a cgroup .*, got {tmp_path}: .*no controller"):
        find_groups(str(tmp_path))
    with pytest.raises(SandboxMissing, match="got /nowhere: "):
        find_groups("/nowhere")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("group", "mounts", "expected"),
    [
        ("0::/a/b\n", "30 24 0:26 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n", "/sys/fs/cgroup/a/b"),
        ("4:memory:/x\n0::/\n", "9 8 0:7 / /sys/fs/cgroup/unified rw - cgroup2 c rw\n", "/sys/fs/cgroup/unified"),
        ("0::/pod/b\n", "30 24 0:26 /pod /sys/fs/cgroup ro - cgroup2 cgroup2 rw\n", "/sys/fs/cgroup/b"),
        ("0::/other\n", "30 24 0:26 /pod /sys/fs/cgroup ro - cgroup2 cgroup2 rw\n", None),
        ("4:memory:/x\n", "30 24 0:26 / /sys/fs/cgroup/memory rw - cgroup cgroup rw,memory\n", None),
    ],
)
def test_the_group_of_a_process_is_found(tmp_path: Path, group: str, mounts: str, expected: str | None) -> None:
    (tmp_path / "cgroup").write_text(group)
    (tmp_path / "mountinfo").write_text(f"24 1 8:1 / / rw - ext4 /dev/sda rw\n{mounts}")
    assert own_group(tmp_path) == (None if expected is None else Path(expected))


def test_a_group_that_cannot_be_entered_is_named_with_the_words_of_the_kernel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "given" / "lippmann-worker").mkdir(parents=True)
    monkeypatch.setattr(sandbox_groups, "own_group", lambda: tmp_path / "given" / "lippmann-worker")
    monkeypatch.setattr(sandbox_groups, "_is_given", lambda folder: folder.name == "given")
    monkeypatch.setattr(sandbox_groups, "_limit", lambda folder, _: _as_group_that_is_closed(folder))
    found = find_groups("auto")
    assert isinstance(found, NoGroups)
    assert found.was_given
    assert re.match(rf"{tmp_path}/given: enter: .*cgroup\.procs", found.reason)


def _as_group_that_is_closed(folder: Path) -> None:
    (folder / "memory.max").write_text("max")
    (folder / "cgroup.procs").mkdir()


def test_the_group_of_a_parent_is_not_taken_for_that_of_the_worker(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sandbox_groups, "own_group", lambda: tmp_path / "given" / "shell")
    monkeypatch.setattr(sandbox_groups, "_is_given", lambda folder: folder.name == "given")
    assert find_groups("auto") == NoGroups("the worker is in no cgroup that was delegated to it")


def test_a_group_that_is_named_and_not_used_is_told() -> None:
    assert detect("none", cgroup="/given").unused_group.startswith("LIPPMANN_CGROUP is /given, and no sandbox")
    assert detect("none", cgroup="auto") == Sandbox("none")


def test_a_group_out_of_which_the_worker_cannot_move_is_logged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(sandbox_groups, "own_group", lambda: tmp_path)
    monkeypatch.setattr(sandbox_groups, "_is_given", lambda _: True)
    sandbox_groups.make_room()
    (line,) = caplog.messages
    assert line.startswith(f"the cgroup {tmp_path} is not used")
    assert "cgroup.procs" in line


def test_the_cpu_time_of_a_group_is_that_of_the_kernel(tmp_path: Path) -> None:
    assert TaskGroup((tmp_path,)).cpu_s() == 0
    (tmp_path / "cpu.stat").write_text("usage_usec 2500000\nuser_usec 1\nsystem_usec 2\n")
    assert TaskGroup((tmp_path,)).cpu_s() == 2.5


def test_no_group_is_used_that_was_not_given() -> None:
    assert find_groups("none") == NoGroups("LIPPMANN_CGROUP is none")


@pytest.mark.parametrize(
    ("files", "expected"),
    [
        ({"memory.events": "low 0\nmax 9\noom 1\noom_kill 4\noom_group_kill 1\n"}, True),
        ({"memory.events": "low 0\nmax 9\noom 0\noom_kill 1\n"}, False),
        ({"memory.events": "max 9\noom 1\noom_kill 0\n"}, False),
        ({"memory.events.local": "oom 0\noom_kill 1\n", "memory.events": "oom 1\noom_kill 1\n"}, False),
        ({"memory.oom_control": "oom_kill_disable 0\nunder_oom 0\noom_kill 1\n", "memory.failcnt": "7\n"}, True),
        ({"memory.oom_control": "oom_kill 1\n", "memory.failcnt": "0\n", "memory.memsw.failcnt": "7\n"}, True),
        ({"memory.oom_control": "under_oom 0\noom_kill 1\n", "memory.failcnt": "0\n"}, False),
        ({}, False),
    ],
)
def test_only_a_kill_at_the_own_limit_is_the_limit_of_the_group(
    tmp_path: Path, files: dict[str, str], expected: bool
) -> None:
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert TaskGroup((tmp_path,)).ran_out_of_memory() is expected
