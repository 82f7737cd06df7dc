"""What dies in mid-job is noticed by what is known of it.

The times after which silence and idle orders count are set so high that no test would end by them.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from lippmann.client import Client
from lippmann.farm.supervisor.descendants import descendants
from service.schemas.job import Job
from service.schemas.task import Task
from tests.builders import small_job
from tests.farm import Farm, busy_children, ended, farm_up
from tests.needs import needs_povray
from tests.waiting import halt, until

pytestmark = needs_povray

NEVER = {"LIPPMANN_LEASE_TTL_S": "100000", "LIPPMANN_UNCLAIMED_S": "100000"}
SLOW = small_job("fish", count=(60, 60), frames="1-4", render={"cache": False}).model_copy(update={"outputs": ()})
"""A job whose frames take long enough to be hit."""


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    with farm_up(tmp_path_factory.mktemp("farm"), env=NEVER) as farm:
        yield farm


def running(client: Client, job: Job) -> list[Task]:
    return [task for task in client.tasks(job.id) if task.status == "running" and task.kind == "render"]


def kill_when_busy(farm: Farm, job: Job, *, whole_worker: bool) -> None:
    until(lambda: len(running(farm.client, job)) == 2)
    (worker,) = farm.client.workers().items
    os.kill(worker.pid if whole_worker else until(lambda: busy_children(worker.pid))[0], signal.SIGKILL)


def taken_again(client: Client, job: Job) -> list[Any]:
    return [task for task in client.tasks(job.id) if task.attempt_number == 2]


@pytest.mark.parametrize("whole_worker", [False, True], ids=["pool process", "worker"])
def test_the_task_of_what_was_killed_runs_again(farm: Farm, whole_worker: bool) -> None:
    job = farm.client.submit(SLOW)
    kill_when_busy(farm, job, whole_worker=whole_worker)
    until(lambda: taken_again(farm.client, job))
    job = ended(farm.client, job.id)
    assert (job.status, job.frames_done) == ("done", 4)
    again = taken_again(farm.client, job)
    assert len(again) == (2 if whole_worker else 1)


def test_the_scratch_folder_of_a_killed_pool_process_is_removed_while_its_neighbour_works_on(farm: Farm) -> None:
    job = farm.client.submit(SLOW)
    until(lambda: len(running(farm.client, job)) == 2)
    (worker,) = farm.client.workers().items
    killed, living = until(lambda: _two(busy_children(worker.pid)))
    left, kept = attempt_folder(killed, farm.data_dir), attempt_folder(living, farm.data_dir)
    renderers = descendants(living)
    for pid in renderers:
        halt(pid)  # the neighbour cannot end and remove its folder itself
    os.kill(killed, signal.SIGKILL)
    until(lambda: not left.exists())
    until(lambda: taken_again(farm.client, job))
    assert kept.is_dir()
    assert [each.pid for each in farm.client.workers().items] == [worker.pid]
    send(signal.SIGCONT, renderers)
    assert ended(farm.client, job.id).status == "done"
    assert until(lambda: not list((farm.data_dir / "scratch" / "attempts").iterdir()))


def _two(found: list[int]) -> list[int]:
    return found if len(found) == 2 else []


def attempt_folder(pid: int, data_dir: Path) -> Path:
    """Return the scratch folder in which a pool process works: it holds the lock of the folder."""
    attempts = (data_dir / "scratch" / "attempts").resolve()

    def locked() -> list[Path]:
        links = [Path(os.readlink(link)) for link in Path(f"/proc/{pid}/fd").iterdir()]
        return [link for link in links if link.parent == attempts and not link.suffix]  # the other is its log

    folder: Path = until(locked)[0]
    return folder


def send(number: signal.Signals, pids: Iterable[int]) -> None:
    for pid in pids:
        with suppress(ProcessLookupError):
            os.kill(pid, number)


def test_a_farm_that_was_killed_and_started_again_knows_that_its_workers_died(tmp_path: Path) -> None:
    with farm_up(tmp_path, env=NEVER) as farm:
        job = farm.client.submit(SLOW)
        until(lambda: len(running(farm.client, job)) == 2)
        farm.kill()
    with farm_up(tmp_path, env=NEVER) as farm:
        job = ended(farm.client, job.id)
        assert (job.status, job.frames_done) == ("done", 4)
        assert len(taken_again(farm.client, job)) >= 2


def broker_pid(farm: Farm) -> int:
    """Return the process of the farm's broker."""

    def is_broker(pid: int) -> bool:
        with suppress(OSError):
            return b"-server unixsocket:" in Path(f"/proc/{pid}/cmdline").read_bytes()
        return False

    found = until(lambda: [pid for pid in descendants(farm.process.pid) if is_broker(pid)])
    return int(found[0])


def test_a_job_goes_on_though_its_broker_is_started_again_and_again(farm: Farm) -> None:
    job = farm.client.submit(SLOW)
    kill_when_busy(farm, job, whole_worker=True)
    stop = threading.Event()

    def restart_often() -> None:
        for _ in range(4):  # at the fifth quick death, the supervisor gives up
            if stop.wait(20.0):
                return
            os.kill(broker_pid(farm), signal.SIGKILL)

    thread = threading.Thread(target=restart_often)
    thread.start()
    try:
        job = ended(farm.client, job.id)
    finally:
        stop.set()
        thread.join()
    assert (job.status, job.frames_done) == ("done", 4)
    assert len(taken_again(farm.client, job)) >= 2
