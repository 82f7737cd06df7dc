"""The rounds of the coordinator after gaps in reading events: a real broker, and clocks that the test moves."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy.exc import OperationalError

from lippmann.job.messages import wire
from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from service.broker_stream import Entry
from service.coordinator import coordinator as module
from service.coordinator.coordinator import BATCH, Coordinator
from service.coordinator.leader_election import LeaderElection
from service.db import coordinator as coordinator_rows
from service.db.tables import BackgroundJob, Job
from service.errors import NotLeading
from service.events.wakeup import Wakeup
from service.jobs.commands import remove_job
from service.store_identity import identify_store
from tests.broker import Broker
from tests.builders_messages import add_event, put_presence, seals_in
from tests.builders_service import T0, Farm, claimed, done, failed, heartbeat, presence
from tests.integration.service.conftest import ORDERS


class Rounds:
    """A farm whose coordinator runs a round when the test says so."""

    def __init__(self, tmp_path: Path, broker: Broker) -> None:
        url = f"sqlite:///{tmp_path}/farm.db"
        self.farm = Farm(url, redis_url=broker.url, data_dir=tmp_path, tick_s=0.01, leader_ttl_s=600)
        self.steady_s = 0.0
        self.client = broker.client
        self.seals = seals_in(tmp_path)
        self.wakeup = Wakeup()
        self.coordinator = Coordinator(
            self.farm.database, self.farm.store, self.farm.settings, self.wakeup,
            clock=lambda: self.farm.now_s, steady=lambda: self.steady_s,
        )  # fmt: skip
        self.coordinator.election_round()
        self.coordinator.loss_round()
        self.wait(2)  # the list of workers that the round read is no longer new

    def send(self, *events: Event) -> None:
        for event in events:
            add_event(self.client, event, self.seals)

    def running(self) -> list[Order]:
        """Return orders that attempts are at work on."""
        self.farm.planned(frames="1-9")
        with self.farm.writing() as session:
            coordinator_rows.reset_position(session)
        orders = self.farm.dispatch()
        self.send(*(claimed(order) for order in orders))
        self.coordinator.consume_round()
        return orders

    def wait(self, seconds: float) -> None:
        self.farm.now_s += seconds
        self.steady_s += seconds

    def listen(self, seconds: int) -> None:
        for _ in range(seconds // 5):
            self.wait(5)
            self.coordinator.consume_round()
            self.coordinator.loss_round()

    def statuses(self, orders: list[Order]) -> set[TaskStatus]:
        return {self.farm.task(order).status for order in orders}


@pytest.fixture
def rounds(tmp_path: Path, broker: Broker) -> Iterator[Rounds]:
    rounds = Rounds(tmp_path, broker)
    yield rounds
    rounds.coordinator.stop()
    rounds.farm.database.dispose()


def _away(*_: object, **__: object) -> bool:
    raise OperationalError("BEGIN IMMEDIATE", {}, Exception("database is locked"))


def _database_away(rounds: Rounds, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patched:
        patched.setattr(module, "consume_events", _away)
        rounds.send(heartbeat(rounds.farm.queue.orders[0]))
        for _ in range(12):
            rounds.wait(5)
            with pytest.raises(OperationalError):
                rounds.coordinator.consume_round()


def _machine_slept(rounds: Rounds, _: pytest.MonkeyPatch) -> None:
    rounds.farm.now_s += 3600


def _follower_hung(rounds: Rounds, _: pytest.MonkeyPatch) -> None:
    rounds.wait(3600)


@pytest.mark.parametrize("gap", [_database_away, _machine_slept, _follower_hung])
def test_nobody_is_lost_in_a_gap_and_the_silent_are_lost_after_their_usual_time(
    rounds: Rounds, monkeypatch: pytest.MonkeyPatch, gap: Callable[[Rounds, pytest.MonkeyPatch], None]
) -> None:
    orders = rounds.running()
    rounds.listen(10)
    gap(rounds, monkeypatch)
    rounds.coordinator.loss_round()
    assert rounds.statuses(orders) == {TaskStatus.RUNNING}
    rounds.listen(45)
    assert rounds.statuses(orders) == {TaskStatus.RUNNING}
    rounds.listen(20)
    assert rounds.statuses(orders) == {TaskStatus.READY}


def test_a_round_that_could_not_be_written_gives_everyone_time_to_send_again(
    rounds: Rounds, monkeypatch: pytest.MonkeyPatch
) -> None:
    orders = rounds.running()
    rounds.listen(40)
    rounds.send(heartbeat(orders[0]))
    with monkeypatch.context() as patched:
        patched.setattr(module, "consume_events", _away)
        with pytest.raises(OperationalError):
            rounds.coordinator.consume_round()
    rounds.listen(10)
    assert rounds.statuses(orders) == {TaskStatus.RUNNING}
    rounds.listen(30)
    assert TaskStatus.READY in rounds.statuses(orders)


def test_a_heartbeat_is_written_with_what_follows_it_and_wakes_no_scheduler(
    rounds: Rounds, monkeypatch: pytest.MonkeyPatch
) -> None:
    order, *_ = rounds.running()
    with rounds.wakeup.for_thread() as woken:
        rounds.send(heartbeat(order))
        rounds.coordinator.consume_round()
        assert not woken.is_set()
        stream, reads = rounds.coordinator._stream, list[str]()
        read = stream.read

        def read_as_more_comes(position: str, *, count: int, block_s: float) -> list[Entry]:
            rounds.send(done(order) if reads else heartbeat(order))
            reads.append(position)
            return read(position, count=count, block_s=block_s)

        monkeypatch.setattr(stream, "read", read_as_more_comes)
        rounds.coordinator.consume_round()
        assert woken.is_set()
    assert len(reads) == 2
    assert rounds.statuses([order]) == {TaskStatus.DONE}


def test_a_heartbeat_of_an_attempt_that_must_stop_wakes_the_scheduler(rounds: Rounds) -> None:
    order, *_ = rounds.running()
    late = heartbeat(order).model_copy(update={"attempt": "taken-back"})
    with rounds.wakeup.for_thread() as woken:
        rounds.send(late)
        rounds.coordinator.consume_round()
        assert woken.is_set()
    rounds.coordinator.schedule_round()
    assert rounds.client.exists(wire.stop_key("taken-back"))


def test_the_silent_are_lost_though_the_farm_is_so_busy_that_rounds_are_full(rounds: Rounds) -> None:
    silent, talkative, *_ = rounds.running()
    for _ in range(12):
        rounds.send(*(heartbeat(talkative) for _ in range(BATCH + 1)))
        rounds.listen(10)
    assert rounds.statuses([silent]) == {TaskStatus.READY}
    assert rounds.statuses([talkative]) == {TaskStatus.RUNNING}


def test_a_new_leader_counts_the_slots_before_it_plans(rounds: Rounds, broker: Broker) -> None:
    put_presence(broker.client, presence("w1", slots=8), rounds.seals)
    farm = rounds.farm
    job_id = farm.submit(
        frames="1", render={"tiles": "auto"}, rig={"lens_array": {"count": [90, 90]}, "px_per_lens": 16}
    )
    (order,) = farm.dispatch()
    probe = done(order).probe
    assert probe is not None
    slow = probe.model_copy(update={"s_per_px": 50.0 / (90 * 16) ** 2})
    farm.say(done(order).model_copy(update={"probe": slow}))
    rounds.coordinator.schedule_round()
    plan = farm.job(job_id).plan
    assert plan is not None
    assert plan["tile_rows"] == 10, "tiles of 5 s; a single slot would get two tiles"


def test_a_job_whose_artifacts_take_long_to_remove_keeps_no_order_from_going_out(
    rounds: Rounds, broker: Broker, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_presence(broker.client, presence("w1"), rounds.seals)
    farm = rounds.farm
    large = farm.planned()
    farm.work()
    assert farm.job(large).status is JobStatus.DONE
    with farm.writing() as session:
        remove_job(session, large)
    dispatched = []

    def delete_slowly(name: str) -> None:
        rounds.coordinator.schedule_round()  # as the thread of the scheduler does meanwhile
        dispatched.append(farm.job(job_id).dispatched)

    monkeypatch.setattr(farm.store, "delete", delete_slowly)
    job_id = farm.submit()
    rounds.coordinator.remove_round()
    assert set(dispatched) == {1}
    assert farm.tasks(job_id)[0].kind is TaskKind.PROBE
    with farm.database.reading() as session:
        assert session.get(Job, large) is None


def test_a_clock_that_is_set_back_hides_no_worker(rounds: Rounds, broker: Broker) -> None:
    put_presence(broker.client, presence("w1"), rounds.seals)
    job_id = rounds.farm.submit()
    rounds.farm.now_s -= 3600
    rounds.coordinator.schedule_round()
    assert rounds.farm.job(job_id).dispatched == 1


@pytest.mark.parametrize("by_s", [60, 86_400])
def test_a_clock_that_is_set_back_prolongs_no_pause(rounds: Rounds, by_s: int) -> None:
    order, *_ = rounds.running()
    rounds.send(failed(order))
    rounds.coordinator.consume_round()
    rounds.coordinator.reconcile_round()
    begun_s = rounds.farm.now_s
    was_s = rounds.farm.task(order).not_before_s
    assert was_s is not None
    rounds.farm.now_s -= by_s
    rounds.coordinator.reconcile_round()
    is_s = rounds.farm.task(order).not_before_s
    assert is_s is not None
    assert is_s - rounds.farm.now_s == pytest.approx(was_s - begun_s)


def _dump(rounds: Rounds) -> list[str]:
    with closing(sqlite3.connect(rounds.farm.database.url.database or "")) as connection:
        return list(connection.iterdump())


@pytest.mark.parametrize(
    "name",
    [
        "consume_round",
        "schedule_round",
        "fault_round",
        "loss_round",
        "reconcile_round",
        "repair_round",
        "collect_round",
    ],
)
def test_whatever_a_process_does_that_was_stopped_in_mid_round_and_replaced_changes_nothing(
    rounds: Rounds, broker: Broker, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    put_presence(broker.client, presence("w1", slots=30), rounds.seals)
    running, *_ = rounds.running()
    rounds.send(done(running))
    rounds.client.delete(wire.MARKER)
    ready = rounds.farm.submit()
    identify_store(rounds.farm.database, rounds.farm.store)
    rounds.farm.store.away = True
    with rounds.farm.writing() as session:
        session.get_one(Job, running.job_id).background_job = BackgroundJob.VERIFY
        assert coordinator_rows.acquire_leadership(session, "another", now_s=2 * T0, until_s=3 * T0)
    before = _dump(rounds)
    # It had looked whether it leads, and was stopped.
    monkeypatch.setattr(LeaderElection, "is_leader", True)
    with pytest.raises(NotLeading):
        getattr(rounds.coordinator, name)()
    assert _dump(rounds) == before
    assert rounds.client.llen(ORDERS) == 0
    assert rounds.farm.job(ready).dispatched == 0
