"""Jobs that only wait cost next to nothing: what is read and written does not grow with them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest
from sqlalchemy import event, insert, select, update

from lippmann.job.states import JobStatus, TaskStatus
from service.broker_stream import Stream
from service.coordinator import reconciler as reconcile
from service.coordinator.fault_monitor import FaultMonitor
from service.coordinator.reconciler import FarmView, Reconciler
from service.db.tables import Job, Task
from service.store_check import StoreCheck
from tests.builders_messages import SEALS
from tests.builders_service import Farm, claimed, done, failed, presence

MANY = 300


@contextmanager
def _counted(farm: Farm) -> Iterator[list[str]]:
    """Lend a list that gathers every statement."""
    seen: list[str] = []

    def note(_connection: object, _cursor: object, statement: str, *_: object) -> None:
        seen.append(statement)

    event.listen(farm.database._engine, "before_cursor_execute", note)
    try:
        yield seen
    finally:
        event.remove(farm.database._engine, "before_cursor_execute", note)


@pytest.fixture
def database_kind() -> str:
    """Return the one kind whose statements are counted: they are the same on both."""
    return "sqlite"


def _copy(farm: Farm, job_id: str, count: int) -> None:
    """Write a job down again and again, under other names."""
    with farm.writing() as session:
        job = dict(session.execute(select(Job.__table__).where(Job.id == job_id)).mappings().one())
        tasks = [dict(row) for row in session.execute(select(Task.__table__).where(Task.job_id == job_id)).mappings()]
        names = [f"{job_id}{i:05}" for i in range(count)]
        session.execute(insert(Job), [job | {"id": name} for name in names])
        session.execute(insert(Task), [task | {"job_id": name} for name in names for task in tasks])


def _look(farm: Farm, reconciler: Reconciler) -> None:
    reconciler.run(FarmView(now_s=farm.now_s, slots=2, is_live=True))


@pytest.fixture
def queued(make_farm: Callable[..., Farm]) -> list[Farm]:
    """Lend a farm with few jobs in its queue and one with many."""
    farms = [make_farm(), make_farm()]
    for farm, count in zip(farms, (5, MANY), strict=True):
        _copy(farm, farm.submit(), count - 1)
    return farms


def test_a_run_of_the_reconciler_says_as_much_to_the_database_for_many_queued_jobs_as_for_few(
    queued: list[Farm],
) -> None:
    counts = []
    for farm in queued:
        reconciler = Reconciler(farm.database, farm.store, farm.settings)
        with _counted(farm) as seen:
            _look(farm, reconciler)
        counts.append(len(seen))
    assert counts[0] == counts[1]


def test_a_dispatch_does_too_and_reads_only_the_jobs_whose_tasks_go_out(queued: list[Farm]) -> None:
    counts = []
    for farm in queued:
        with _counted(farm) as seen:
            assert len(farm.dispatch()) == 4
        counts.append(len(seen))
        assert not [text for text in seen if "jobs.spec" in text and "jobs.id IN (?, ?, ?, ?)" not in text]
    assert counts[0] == counts[1]


def test_the_reconciler_opens_no_transaction_for_jobs_that_are_right(make_farm: Callable[..., Farm]) -> None:
    counts = []
    for jobs in (1, 3):
        farm = make_farm()
        farm.planned_jobs(jobs)
        order, *_ = farm.dispatch()
        farm.say(claimed(order))
        reconciler = Reconciler(farm.database, farm.store, farm.settings)
        with _counted(farm) as seen:
            assert reconciler.start() == 0
            _look(farm, reconciler)
        counts.append(seen.count("BEGIN IMMEDIATE"))
    assert counts[0] == counts[1]


def test_a_start_says_as_much_to_the_database_for_many_jobs_as_for_few(queued: list[Farm]) -> None:
    counts = []
    for farm in queued:
        with _counted(farm) as seen:
            assert Reconciler(farm.database, farm.store, farm.settings).start() == 0
        counts.append(len(seen))
    assert counts[0] == counts[1]


def test_a_job_that_stays_paused_costs_no_transaction(farm: Farm) -> None:
    job_id = farm.planned()
    stream = Stream("redis://127.0.0.1:1/0", seals=SEALS, timeout_s=0.1)
    check = StoreCheck(farm.store, reserve_bytes=0)
    monitor = FaultMonitor(farm.database, stream, check, farm.settings)
    order, *_ = farm.dispatch()
    farm.say(claimed(order), failed(order, code="store-full"))
    monitor.run(farm.workers, now_s=farm.now_s)
    assert farm.job(job_id).status is JobStatus.PAUSED
    with _counted(farm) as seen:
        monitor.run(farm.workers, now_s=farm.now_s)
    assert "BEGIN IMMEDIATE" not in seen


def test_every_job_that_waits_has_its_turn(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reconcile, "MAX_JOBS", 2)
    jobs = farm.planned_jobs(4)
    farm.work()
    with farm.writing() as session:
        session.execute(update(Job).values(status=JobStatus.RUNNING))
    reconciler = Reconciler(farm.database, farm.store, farm.settings)
    for _ in range(3):
        _look(farm, reconciler)
    assert {farm.job(job_id).status for job_id in jobs} == {JobStatus.DONE}


def test_while_every_task_rests_a_tick_opens_no_transaction(farm: Farm) -> None:
    farm.planned()
    with farm.writing() as session:
        resting = update(Task).where(Task.status == TaskStatus.READY)
        session.execute(resting.values(not_before_s=farm.now_s + 9))
    with _counted(farm) as seen:
        assert farm.dispatch() == []
    assert "BEGIN IMMEDIATE" not in seen
    farm.now_s += 10
    assert len(farm.dispatch()) == 4


def test_a_batch_costs_a_handful_of_statements_whatever_the_number_of_its_tasks(farm: Farm) -> None:
    """Each task used to cost 17.6 statements; 100 tasks together cost as many as 10."""
    farm.planned(frames="1-100")
    counts = []
    for slots in (5, 50):
        farm.workers = [presence(slots=slots)]
        with _counted(farm) as seen:
            orders = farm.dispatch()
            farm.say(*map(claimed, orders))
            farm.say(*map(done, orders))
        assert len(orders) == 2 * slots
        counts.append(len(seen))
    few, many = counts
    assert many <= few + 5
    assert many <= 50
