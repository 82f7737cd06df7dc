"""Processes that make pictures: what a picture can do to them, to others and to the service."""

from __future__ import annotations

import errno
import json
import os
import resource
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from lippmann.errors import ArtifactBroken, StoreUnavailable
from service.errors import Invalid, PictureFailed, ServiceError
from service.ports import Parts
from service.viewing.picture_process import NICENESS
from service.viewing.process_handle import Process, ProcessLimits, _restrain
from service.viewing.process_pool import ProcessPool
from service.viewing.render import Wanted as AnyWanted
from tests import builders_pictures as run
from tests.builders_pictures import Wanted
from tests.waiting import ENOUGH_S, until

LIMITS = ProcessLimits(places=2, room_bytes=10**6, memory_bytes=10**9, timeout_s=ENOUGH_S, idle_s=ENOUGH_S)
SERVICE = """
import sys
from pathlib import Path
from tests import builders_pictures as run
from tests.unit.service.viewing.test_process_pool import LIMITS, parts_on
from service.viewing.process_pool import ProcessPool
folder = Path(sys.argv[1])
ProcessPool(parts_on(folder), LIMITS).make(run.Wanted(run.hang, folder))
"""


class Store:
    """A store of one folder, which counts how often it is read."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.read = folder, list[str]()
        self.error: Exception | None = None

    @contextmanager
    def local_path(self, name: str) -> Iterator[Path]:
        self.read.append(name)
        if self.error is not None:
            raise self.error
        yield self.folder / name


def parts_on(folder: Path) -> Parts:
    anything: Any = None
    store: Any = Store(folder)
    return Parts(store=store, pictures=anything, scenes=anything)


@pytest.fixture
def make_pool(tmp_path: Path) -> Iterator[Callable[..., ProcessPool]]:
    made: list[ProcessPool] = []

    def make(**limits: Any) -> ProcessPool:
        made.append(ProcessPool(parts_on(tmp_path), replace(LIMITS, **limits)))
        return made[-1]

    yield make
    for pool in made:
        pool.close()
        until(lambda pool=pool: not pool.pids)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "told").mkdir()
    return tmp_path / "told"


def is_there(pid: int) -> bool:
    """Return whether a process runs; one that has ended and that nobody has asked for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def begun(folder: Path) -> list[int]:
    return [int(entry.name) for entry in folder.iterdir()]


def failure(pool: ProcessPool, wanted: AnyWanted) -> Callable[[], str]:
    """Begin a picture in a thread; return a function that waits for its failure and returns the message."""
    executor = ThreadPoolExecutor(1)
    future = executor.submit(pool.make, wanted)

    def message() -> str:
        with pytest.raises(PictureFailed) as raised:
            future.result(ENOUGH_S)
        executor.shutdown()
        return raised.value.message

    return message


@pytest.mark.promise(
    "Between processes", "Pictures on demand are made without the environment and the sockets of the service."
)
def test_a_process_that_makes_pictures_gives_way_and_has_nothing_of_the_service(
    make_pool: Callable[..., ProcessPool], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIPPMANN_DATABASE_URL", "postgresql://user:secret@db")
    with socket.socket() as inheritable:
        inheritable.set_inheritable(True)
        known = json.loads(make_pool().make(Wanted(run.facts, folder)))
    assert known["niceness"] == min(19, os.getpriority(os.PRIO_PROCESS, 0) + NICENESS)
    assert known["oom_score_adj"] > int(Path("/proc/self/oom_score_adj").read_text())
    assert not [name for name in known["environment"] if name.startswith("LIPPMANN")]
    assert known["descriptors"].count("socket") == 1


@pytest.mark.promise("People", "A picture on demand that kills its process or never ends costs others nothing.")
def test_a_process_that_is_killed_in_mid_picture_fails_only_this_picture(
    make_pool: Callable[..., ProcessPool], folder: Path
) -> None:
    pool = make_pool()
    message = failure(pool, Wanted(run.hang, folder))
    (victim,) = until(lambda: begun(folder))
    os.kill(victim, signal.SIGKILL)
    assert message() == "the process that made the picture ended by SIGKILL"
    assert int(pool.make(Wanted(run.pid, folder))) != victim


def test_a_picture_that_takes_too_long_is_given_up(make_pool: Callable[..., ProcessPool], folder: Path) -> None:
    pool = make_pool(timeout_s=0.1)
    assert failure(pool, Wanted(run.hang, folder))() == "the picture took longer than 0.1 s and was given up"
    assert not pool.pids


def test_a_picture_that_needs_too_much_memory_is_refused(make_pool: Callable[..., ProcessPool], folder: Path) -> None:
    pool = make_pool()
    with pytest.raises(Invalid, match=r"made in 1000 MB \(LIPPMANN_PICTURE_MEMORY_MB\)"):
        pool.make(Wanted(run.fill_memory, folder))
    assert not pool.pids


def test_two_viewers_are_served_in_parallel_and_the_next_by_the_process_that_knows_its_sheet(
    make_pool: Callable[..., ProcessPool], folder: Path
) -> None:
    pool = make_pool()
    with ThreadPoolExecutor(2) as viewers:
        made = viewers.map(pool.make, [Wanted(run.meet, folder, "a"), Wanted(run.meet, folder, "b")])
        of_a, of_b = map(int, made)
    assert of_a != of_b
    for _ in range(2):
        assert int(pool.make(Wanted(run.pid, folder, "b"))) == of_b
        assert int(pool.make(Wanted(run.pid, folder, "a"))) == of_a
    os.kill(of_a, signal.SIGKILL)
    until(lambda: not is_there(of_a))
    assert int(pool.make(Wanted(run.pid, folder, "a"))) == of_b


def test_a_process_ends_when_nobody_needs_it(make_pool: Callable[..., ProcessPool], folder: Path) -> None:
    pool = make_pool(idle_s=0.0)
    pool.warm_up()
    (warm,) = until(lambda: pool.pids)
    assert int(pool.make(Wanted(run.pid, folder))) == warm
    pool.end_idle()
    assert not is_there(warm)
    assert not pool.pids
    assert int(pool.make(Wanted(run.pid, folder))) != warm


def test_an_error_of_a_picture_or_of_the_store_leaves_the_process(
    make_pool: Callable[..., ProcessPool], folder: Path, tmp_path: Path
) -> None:
    pool = make_pool()
    store: Any = pool._parts.store
    (tmp_path / "sheet").write_bytes(b"light")
    process = pool.make(Wanted(run.pid, folder))
    with pytest.raises(ServiceError, match="u: expected 0 to 3, got 4") as refused:
        pool.make(Wanted(run.refuse, folder))
    assert (refused.value.code, [problem.field for problem in refused.value.problems]) == ("invalid", ["u"])
    with pytest.raises(ArtifactBroken, match="not whole"):
        pool.make(Wanted(run.find_damage, folder))
    with pytest.raises(ServiceError) as unexpected:
        pool.make(Wanted(run.blunder, folder))
    assert (unexpected.value.code, unexpected.value.message) == ("internal", ServiceError().message)
    store.error = StoreUnavailable("away")
    with pytest.raises(StoreUnavailable, match="away"):
        pool.make(Wanted(run.read, folder))
    store.error = OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(PictureFailed, match="the sheet of the picture cannot be read: No space left on device"):
        pool.make(Wanted(run.read, folder))
    store.error = None
    assert pool.make(Wanted(run.read, folder)) == b"light"
    assert pool.make(Wanted(run.pid, folder)) == process


@pytest.mark.parametrize("run_wrong", [run.babble, run.read_twice])
def test_a_process_that_says_what_nobody_expects_is_used_no_longer(
    make_pool: Callable[..., ProcessPool], folder: Path, run_wrong: Callable[[Path], bytes]
) -> None:
    pool = make_pool()
    with pytest.raises(PictureFailed):
        pool.make(Wanted(run_wrong, folder))
    assert not pool.pids


def test_a_process_that_answers_just_before_it_is_killed_for_its_time_is_used_no_longer(
    make_pool: Callable[..., ProcessPool], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def answered_late(process: Process, *given: Any) -> bytes:
        content = answered(process, *given)
        process._end_late()
        return content

    answered = Process._answered
    monkeypatch.setattr(Process, "_answered", answered_late)
    pool = make_pool()
    assert pool.make(Wanted(run.pid, folder))
    assert not pool.pids


def test_a_process_keeps_a_limit_of_memory_that_is_smaller_than_the_setting() -> None:
    with subprocess.Popen(["sleep", str(ENOUGH_S)]) as process:
        resource.prlimit(process.pid, resource.RLIMIT_AS, (10**8, 10**8))
        assert _restrain(process.pid, 10**9) == 10**8
        assert resource.prlimit(process.pid, resource.RLIMIT_AS) == (10**8, 10**8)
        assert _restrain(process.pid, 10**7) == 10**7
        process.kill()


def test_a_process_that_cannot_be_limited_is_ended(
    make_pool: Callable[..., ProcessPool], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pids: list[int] = []

    def refuse(pid: int, _: int) -> int:
        pids.append(pid)
        raise PermissionError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr("service.viewing.process_handle._restrain", refuse)
    with pytest.raises(PictureFailed, match="no process can be started to make the picture: Operation not permitted"):
        make_pool().make(Wanted(run.pid, folder))
    assert not Path(f"/proc/{pids[0]}").exists()


def test_a_service_that_stops_ends_the_pictures_that_are_being_made(
    make_pool: Callable[..., ProcessPool], folder: Path
) -> None:
    pool = make_pool()
    message = failure(pool, Wanted(run.hang, folder))
    (process,) = until(lambda: begun(folder))
    pool.close()
    assert "SIGKILL" in message()
    assert not is_there(process)
    with pytest.raises(PictureFailed, match="the service stops"):
        pool.make(Wanted(run.pid, folder))


def test_a_service_that_is_killed_leaves_no_process(folder: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", SERVICE, str(folder)], env=os.environ) as service:
        (process,) = until(lambda: begun(folder))
        assert is_there(process)
        service.kill()
    until(lambda: not is_there(process))


def test_a_process_outlives_the_thread_that_asked_for_it_first(
    make_pool: Callable[..., ProcessPool], folder: Path
) -> None:
    pool = make_pool()
    thread = threading.Thread(target=pool.make, args=[Wanted(run.pid, folder)])
    thread.start()
    thread.join()
    (process,) = pool.pids
    assert int(pool.make(Wanted(run.pid, folder))) == process
