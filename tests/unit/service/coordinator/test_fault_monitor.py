"""Jobs whose work a full disk prevents are paused with the reason, and go on by themselves."""

from __future__ import annotations

import shutil
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from lippmann.digest import Digest
from lippmann.errors import StoreUnavailable
from lippmann.job.messages.events import Presence, PresenceFault
from lippmann.job.states import JobAction, JobStatus, PausedBy, TaskStatus
from service.broker_stream import Stream
from service.coordinator.fault_monitor import FaultMonitor
from service.coordinator.orphan_sweeper import sweep_orphans
from service.db import coordinator as coordinator_rows
from service.jobs.artifact_repair import repair_artifact
from service.jobs.commands import cancel_job, pause_job, resume_job
from service.schemas.farm import Fault
from service.store_check import StoreCheck
from service.store_identity import identify_store
from tests.builders_messages import SEALS
from tests.builders_service import Client, DictStore, Farm, claimed, done, failed, presence
from worker.store.local import LocalStore

STORE_FULL = "The artifact store has no room left: No space left on device."
STORE_AWAY = "The artifact store cannot be written: Read-only file system."
SCRATCH_FULL = PresenceFault(code="disk-full", message="no room in /scratch: 3 MB are free")


def _stream() -> Stream:
    return Stream("redis://127.0.0.1:1/0", seals=SEALS, timeout_s=0.1)


class Watched:
    """A farm with a fault monitor; nothing listens at its broker."""

    def __init__(self, farm: Farm) -> None:
        self.farm = farm
        self.monitor = self.new_monitor()

    def new_monitor(self) -> FaultMonitor:
        stream = _stream()
        check = StoreCheck(self.farm.store, reserve_bytes=self.farm.settings.disk_reserve_bytes)
        return FaultMonitor(self.farm.database, stream, check, self.farm.settings)

    def run(self, *, after_s: float = 20.0) -> None:
        """Run a round so much later that every check is due."""
        self.farm.now_s += after_s
        self.monitor.run(self.farm.workers, now_s=self.farm.now_s)

    def pause(self, job_id: str) -> tuple[JobStatus, PausedBy | None, str | None]:
        job = self.farm.job(job_id)
        return job.status, job.paused_by, job.pause_reason

    def faults(self) -> list[str]:
        with self.farm.database.reading() as session:
            return [fault.component for fault in coordinator_rows.faults(session)]

    def act(self, action: Callable[..., Any], job_id: str) -> None:
        more = {"limit": self.farm.settings.failure_limit} if action is resume_job else {}
        with self.farm.writing() as session:
            action(session, job_id, now_s=self.farm.now_s, **more)


@pytest.fixture
def watched(farm: Farm) -> Watched:
    return Watched(farm)


RUNNING = (JobStatus.RUNNING, None, None)


@pytest.mark.parametrize(("fault", "reason"), [("full", STORE_FULL), ("away", STORE_AWAY)])
def test_a_store_that_takes_nothing_pauses_every_job_with_the_reason_until_it_takes_files_again(
    watched: Watched, fault: str, reason: str
) -> None:
    first, second = watched.farm.planned_jobs(2)
    running, *_ = watched.farm.dispatch()
    watched.farm.say(claimed(running))
    setattr(watched.farm.store, fault, True)
    watched.run()
    for job_id in (first, second):
        assert watched.pause(job_id) == (JobStatus.PAUSED, PausedBy.FARM, reason)
    assert (watched.faults(), watched.farm.dispatch()) == (["store"], [])
    assert watched.farm.task(running).status is TaskStatus.RUNNING, "what runs may end"
    setattr(watched.farm.store, fault, False)
    watched.run()
    assert [watched.pause(job_id) for job_id in (first, second)] == [RUNNING, RUNNING]
    assert (watched.faults(), watched.monitor.faults) == ([], ())
    watched.farm.say(done(running))
    watched.farm.work()
    assert {watched.farm.job(job_id).status for job_id in (first, second)} == {JobStatus.DONE}
    assert {task.failures for job_id in (first, second) for task in watched.farm.tasks(job_id)} == {0}


def test_a_process_that_leads_again_ends_the_faults_that_another_leader_found(watched: Watched) -> None:
    job_id = watched.farm.planned()
    watched.run()
    first, watched.monitor = watched.monitor, watched.new_monitor()
    watched.farm.store.away = True
    watched.run()
    assert watched.faults() == ["store"]
    watched.farm.store.away = False
    watched.monitor = first
    first.begin()
    watched.run()
    assert (watched.faults(), watched.pause(job_id)) == ([], RUNNING)


def test_an_empty_folder_in_the_place_of_the_store_pauses_jobs_and_loses_no_artifact(
    watched: Watched, tmp_path: Path
) -> None:
    farm, root = watched.farm, tmp_path / "store"
    job_id = farm.planned()
    farm.work()
    store = LocalStore(root)
    for name, data in farm.store.files.items():
        store.put_bytes(name, data)
    identify = partial(identify_store, farm.database, store)
    check = StoreCheck(store, reserve_bytes=0, identify=identify)
    watched.monitor = FaultMonitor(farm.database, _stream(), check, farm.settings)
    watched.run()
    assert watched.faults() == []
    other = farm.planned()
    root.rename(tmp_path / "disk")
    LocalStore(root)  # a process that starts meanwhile
    watched.run()
    reason = "The artifact store cannot be written: the folder in its place has no id."
    assert watched.pause(other) == (JobStatus.PAUSED, PausedBy.FARM, reason)
    with pytest.raises(StoreUnavailable):
        repair_artifact(farm.database, store, job_id, "integral/0001.exr")
    sweep_orphans(farm.database, LocalStore(tmp_path / "disk"), now_s=farm.now_s)
    assert {task.status for task in farm.tasks(job_id)} == {TaskStatus.DONE}
    shutil.rmtree(root)
    (tmp_path / "disk").rename(root)
    watched.run()
    assert (watched.pause(other), watched.faults()) == (RUNNING, [])
    assert {order.store_id for order in farm.dispatch()} == {store.identity()}


def test_of_several_causes_the_first_is_the_reason_and_a_job_goes_on_when_all_have_gone(watched: Watched) -> None:
    job_id = watched.farm.planned()
    watched.farm.store.full = True
    watched.run()
    watched.farm.workers = [_broken("w1"), _broken("w2")]
    watched.run()
    assert (watched.faults(), watched.pause(job_id)[2]) == (["store", "workers"], STORE_FULL)
    watched.farm.store.full = False
    watched.run()
    assert watched.faults() == ["workers"]
    status, by, reason = watched.pause(job_id)
    assert (status, by) == (JobStatus.PAUSED, PausedBy.FARM)
    assert reason == "No worker can work; w1: no room in /scratch: 3 MB are free."
    watched.farm.workers = [_broken("w1"), presence("w2")]
    watched.run()
    assert watched.pause(job_id) == RUNNING


def _broken(name: str) -> Presence:
    return presence(name).model_copy(update={"fault": SCRATCH_FULL})


def test_a_worker_at_fault_gets_no_orders_and_the_jobs_go_on_with_the_others(watched: Watched) -> None:
    job_id = watched.farm.planned()
    watched.farm.workers = [_broken("w1"), presence("w2")]
    watched.run()
    assert watched.pause(job_id) == RUNNING
    orders = watched.farm.dispatch()
    assert len(orders) == watched.farm.settings.orders_per_slot * 2, "the slots of the worker at fault do not count"
    assert {order.avoid for order in orders} == {("w1",)}


def test_a_users_pause_is_not_the_farms_and_stays(watched: Watched) -> None:
    mine, other = watched.farm.planned_jobs(2)
    watched.act(pause_job, mine)
    watched.farm.store.full = True
    watched.run()
    assert watched.pause(mine) == (JobStatus.PAUSED, PausedBy.USER, None)
    watched.act(pause_job, other)  # what the farm has paused shall stay paused
    watched.farm.store.full = False
    watched.run()
    assert [watched.pause(job_id)[:2] for job_id in (mine, other)] == [(JobStatus.PAUSED, PausedBy.USER)] * 2


def test_a_user_who_resumes_has_it_tried_at_once_and_it_is_paused_again_while_the_cause_lasts(
    watched: Watched,
) -> None:
    job_id = watched.farm.planned()
    watched.farm.store.full = True
    watched.run()
    watched.act(resume_job, job_id)
    watched.run(after_s=0.0)
    assert watched.pause(job_id) == (JobStatus.PAUSED, PausedBy.FARM, STORE_FULL)
    watched.act(resume_job, job_id)
    watched.farm.store.full = False
    watched.run(after_s=0.0)
    assert (watched.pause(job_id), watched.monitor.faults) == (RUNNING, ())


def test_a_paused_job_is_cancelled_though_the_store_is_full(watched: Watched) -> None:
    job_id = watched.farm.planned()
    watched.farm.store.full = True
    watched.run()
    watched.act(cancel_job, job_id)
    assert watched.pause(job_id) == (JobStatus.CANCELLED, None, None)
    watched.farm.store.full = False
    watched.run()
    assert watched.farm.job(job_id).status is JobStatus.CANCELLED


def test_a_queued_job_waits_in_the_queue(watched: Watched) -> None:
    watched.farm.store.full = False
    job_id = watched.farm.submit()
    watched.farm.store.full = True
    watched.run()
    assert watched.farm.job(job_id).status is JobStatus.QUEUED
    assert watched.monitor.faults, "the scheduler dispatches nothing while there are faults"


def test_a_job_that_no_worker_can_do_is_paused_alone_and_tried_again_later(watched: Watched) -> None:
    watched.farm.workers = [presence("w1"), presence("w2")]
    large, small = watched.farm.planned_jobs(2)
    orders = [order for order in watched.farm.dispatch() if order.job_id == large][:2]
    watched.farm.say(claimed(orders[0], "w1"), failed(orders[0], "w1", code="store-full"))
    watched.run(after_s=1.0)
    assert watched.pause(large) == RUNNING, "the other worker may still do it"
    watched.farm.say(claimed(orders[1], "w2"), failed(orders[1], "w2", code="store-full"))
    watched.run(after_s=1.0)
    reason = "No worker can do its work; w2: store-full happened"
    assert watched.pause(large) == (JobStatus.PAUSED, PausedBy.FARM, reason)
    assert watched.pause(small) == RUNNING
    watched.run(after_s=watched.farm.settings.deferral_s)
    assert watched.pause(large) == RUNNING
    assert {task.failures for task in watched.farm.tasks(large)} == {0}


@pytest.mark.parametrize("changes", [{"pool": "day"}, {"closed": "draining"}, {"fault": SCRATCH_FULL}])
def test_a_job_is_paused_when_those_workers_cannot_do_it_that_may_and_take_orders(
    watched: Watched, changes: dict[str, Any]
) -> None:
    fits = presence("w1").model_copy(update={"pool": "night"})
    watched.farm.workers = [fits, fits.model_copy(update={"name": "w2", **changes})]
    job_id = watched.farm.planned(workers={"pool": "night"})
    order = watched.farm.dispatch()[0]
    watched.farm.say(claimed(order, "w1"), failed(order, "w1", code="store-full"))
    watched.run(after_s=1.0)
    reason = "No worker can do its work; w1: store-full happened"
    assert watched.pause(job_id) == (JobStatus.PAUSED, PausedBy.FARM, reason)
    watched.farm.workers[1] = fits.model_copy(update={"name": "w2"})
    watched.run(after_s=1.0)
    assert watched.pause(job_id) == RUNNING, "the other worker may do it again"


def test_a_new_leader_resumes_what_the_old_one_paused(watched: Watched) -> None:
    job_id = watched.farm.planned()
    watched.farm.store.full = True
    watched.run()
    watched.monitor = watched.new_monitor()
    watched.farm.store.full = False
    watched.run()
    assert watched.pause(job_id) == RUNNING


def test_after_the_fault_no_worker_is_avoided_and_no_task_waits(watched: Watched) -> None:
    job_id = watched.farm.planned()
    order, *_ = watched.farm.dispatch()
    watched.farm.store.full = True
    for _ in range(3):
        watched.farm.say(claimed(order), failed(order, code="store-full"))
    watched.run(after_s=0.0)
    watched.farm.store.full = False
    watched.run(after_s=1.0)
    again = next(sent for sent in watched.farm.dispatch() if sent.task_id == order.task_id)
    assert (again.avoid, watched.farm.task(order).deferrals, watched.pause(job_id)) == ((), 0, RUNNING)


def test_the_store_is_checked_with_a_growing_pause_and_at_once_after_a_failure(watched: Watched) -> None:
    stored = _Counting()
    watched.farm.store = stored
    watched.monitor = watched.new_monitor()
    for _ in range(60):
        watched.run(after_s=1.0)
    assert len(stored.times) == 4, "every 15 s while all is well"
    stored.full = True
    watched.monitor.poke()
    stored.times.clear()
    for second in range(60):
        stored.now = second
        watched.run(after_s=1.0)
    assert stored.times == [0, 1, 3, 7, 15, 30, 45]


class _Counting(DictStore):
    """A store that counts what is written to it."""

    def __init__(self) -> None:
        super().__init__()
        self.times: list[int] = []
        self.now = 0

    def put_bytes(self, name: str, data: bytes) -> Digest:
        self.times.append(self.now)
        return super().put_bytes(name, data)


def test_a_store_without_an_answer_is_a_fault_and_blocks_nothing() -> None:
    hung = threading.Event()

    class Hanging(DictStore):
        def put_bytes(self, name: str, data: bytes) -> Digest:
            hung.wait()
            return super().put_bytes(name, data)

    check = StoreCheck(Hanging(), reserve_bytes=0, answer_s=0.05)
    for _ in range(3):
        error = check.error()
        assert error is not None
        assert error.message == "The artifact store does not answer within 0.05 s."
    assert sum(thread.name == "store-check" for thread in threading.enumerate()) == 1
    hung.set()


def test_a_database_that_does_not_answer_is_no_fault_of_the_store() -> None:
    came_back = threading.Event()

    def wait_for_database() -> None:
        came_back.wait()

    check = StoreCheck(DictStore(), reserve_bytes=0, answer_s=0.05, identify=wait_for_database)
    assert check.error() is None
    came_back.set()
    assert check.error() is None


def test_a_store_below_its_reserve_is_full_until_half_as_much_more_is_free() -> None:
    store = DictStore()
    check = StoreCheck(store, reserve_bytes=50_000_000)
    answers = []
    for free in (60, 49, 60, 80, 60):
        store.free = free * 1_000_000
        error = check.error()
        answers.append(error and error.message)
    full = "The artifact store has no room left: {} MB are free."
    assert answers == [None, full.format(49), full.format(60), None, None]
    assert store.files == {}


def test_page_command_and_health_say_it(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.planned()
    watched = Watched(api_farm)
    api_farm.store.full = True
    watched.run()
    job = api.get(f"/api/v1/jobs/{job_id}").json()
    assert {name: job["pause"][name] for name in ("by", "code", "reason")} == {
        "by": "farm", "code": "store-full", "reason": STORE_FULL,
    }  # fmt: skip
    assert job["actions"] == [JobAction.PAUSE, JobAction.RESUME, JobAction.CANCEL, JobAction.PRIORITISE]
    health = api.get("/api/v1/health").json()
    assert (health["status"], health["store"]["ok"], health["store"]["detail"]) == ("degraded", False, STORE_FULL)
    assert [Fault.model_validate(fault).code for fault in health["faults"]] == ["store-full"]
    refused = api.post("/api/v1/jobs", json={"scene": "ball"})
    assert (refused.status_code, refused.json()["code"]) == (507, "store-full")
    assert api.post(f"/api/v1/jobs/{job_id}/cancel").status_code == 200
    assert api.get(f"/api/v1/jobs/{job_id}").json()["pause"] is None
