"""What a real broker says of dead workers and lost orders reaches the rows of their tasks."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
import structlog
from sqlalchemy.exc import OperationalError

from lippmann.job.messages import wire
from lippmann.job.messages.events import Lease, Presence
from lippmann.job.messages.orders import Order
from lippmann.job.states import TaskStatus
from service.broker_stream import Stream, attempt_of
from service.coordinator.liveness import Liveness
from service.coordinator.loss_monitor import LossMonitor
from service.coordinator.reconciler import Reconciler
from service.db import jobs as job_rows
from service.db import tasks as task_rows
from service.db.task_state import HeldAttempt
from service.order_queue import OrderQueue
from tests.broker import Broker
from tests.builders_messages import SEALS
from tests.builders_service import Farm, claimed, presence


class Watch:
    """A loss monitor on a broker, with a clock that the test moves."""

    def __init__(self, farm: Farm, broker: Broker) -> None:
        self.farm, self.client = farm, broker.client
        self.steady_s = 0.0
        self.stream = Stream(broker.url, seals=SEALS, timeout_s=30)
        self.queue = OrderQueue(broker.url, seals=SEALS, timeout_s=30)
        self.liveness = Liveness(silence_s=1e6, clock=lambda: farm.now_s, steady=lambda: self.steady_s)
        reconciler = Reconciler(farm.database, farm.store, farm.settings)
        self.monitor = LossMonitor(farm.database, self.stream, reconciler, self.liveness, farm.settings)
        self.wait(20)
        self.monitor.begin(now_s=farm.now_s)
        self.monitor.take_back_if_wiped(now_s=farm.now_s)

    def wait(self, seconds: int) -> None:
        for _ in range(seconds):
            self.farm.now_s += 1
            self.steady_s += 1
            self.liveness.record_round(caught_up=True)

    def look(self, *workers: Presence, first_order: str | None = None) -> int:
        self.wait(2)
        return self.monitor.run(workers, {"": first_order}, now_s=self.farm.now_s)

    def lease(self, order: Order, *, at_s: float) -> None:
        lease = Lease(attempt=order.attempt, worker="w1", instance="i1", at_s=at_s)
        self.client.set(wire.lease_key(order.attempt), SEALS.sealed_lease(lease))


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


@pytest.fixture
def watch(farm: Farm, broker: Broker) -> Iterator[Watch]:
    watch = Watch(farm, broker)
    yield watch
    watch.stream.close()
    watch.queue.close()
    watch.client.close()


def worker(instance: str, *, seen_s: float, holds: tuple[str, ...] = ()) -> Presence:
    return presence("w1").model_copy(update={"instance": instance, "seen_s": seen_s, "holds": holds})


def running(watch: Watch) -> Order:
    watch.farm.planned()
    order, *others = watch.farm.dispatch()
    watch.farm.say(claimed(order).model_copy(update={"instance": "i1"}))
    watch.monitor._reconciler.take_back(  # only this one is left
        [each for each in held(watch) if each.attempt in {other.attempt for other in others}], now_s=watch.farm.now_s
    )
    return order


def held(watch: Watch) -> list[HeldAttempt]:
    with watch.farm.database.reading() as session:
        return task_rows.held(session, job_rows.busy_ids(session))


def test_the_attempt_of_a_restarted_worker_is_lost_with_the_reason(watch: Watch) -> None:
    order = running(watch)
    watch.lease(order, at_s=100.0)
    returned = worker("i2", seen_s=104.0)
    assert watch.look(returned) == 0
    with structlog.testing.capture_logs() as logged:
        assert watch.look(returned) == 1
    ids = {"job": order.job_id, "task": order.task_id, "attempt": order.attempt, "worker": "w1"}
    assert ids.items() <= logged[0].items()
    task = watch.farm.task(order)
    assert (task.status, task.error_code) == (TaskStatus.READY, "lost")
    assert task.error_message == "worker w1 was restarted"


@pytest.mark.promise("Between processes", "A lease that is not signed does not keep the attempt of a lost worker.")
@pytest.mark.parametrize("text", ["w1", Lease(worker="w1", instance="i1", at_s=103.0).model_dump_json()])
def test_a_forged_lease_keeps_nothing_and_is_counted(watch: Watch, text: str) -> None:
    order = running(watch)
    watch.client.set(wire.lease_key(order.attempt), text)
    returned = worker("i2", seen_s=104.0)
    assert [watch.look(returned) for _ in range(2)] == [0, 1]
    assert watch.stream.dropped == {"lease": 2}


def test_a_lease_that_is_renewed_keeps_an_attempt(watch: Watch) -> None:
    order = running(watch)
    watch.lease(order, at_s=103.0)
    assert [watch.look(worker("i2", seen_s=104.0)) for _ in range(20)] == [0] * 20
    assert watch.farm.task(order).status is TaskStatus.RUNNING


def test_an_attempt_that_its_worker_holds_is_kept_without_a_lease(watch: Watch) -> None:
    order = running(watch)
    assert [watch.look(worker("i1", seen_s=104.0, holds=(order.attempt,))) for _ in range(20)] == [0] * 20


def test_an_order_that_is_nowhere_is_sent_again_and_counts_as_no_failure(watch: Watch) -> None:
    watch.farm.planned()
    order, *_ = watch.farm.dispatch()
    found = [watch.look(worker("i1", seen_s=104.0)) for _ in range(4)]
    assert found[:3] == [0, 0, 0]
    assert found[3] > 0
    assert (watch.farm.task(order).status, watch.farm.task(order).failures) == (TaskStatus.READY, 0)


def test_a_wiped_broker_has_lost_the_orders_of_before_and_none_of_those_after(watch: Watch) -> None:
    watch.farm.planned()
    first, *_ = watch.farm.dispatch()
    watch.wait(1)
    assert watch.monitor.take_back_if_wiped(now_s=watch.farm.now_s) == 0
    watch.client.flushall()
    watch.wait(1)
    watch.farm.workers = [presence(slots=3)]
    later = watch.farm.dispatch()
    assert later
    watch.wait(1)
    assert watch.monitor.take_back_if_wiped(now_s=watch.farm.now_s) == 4
    assert watch.farm.task(first).status is TaskStatus.READY
    assert {watch.farm.task(order).status for order in later} == {TaskStatus.DISPATCHED}


def test_a_wiped_broker_is_examined_until_its_orders_are_taken_back(
    watch: Watch, monkeypatch: pytest.MonkeyPatch
) -> None:
    watch.farm.planned()
    order, *_ = watch.farm.dispatch()
    watch.wait(1)
    assert watch.monitor.take_back_if_wiped(now_s=watch.farm.now_s) == 0
    watch.client.flushall()

    def fail(*_: object, **__: object) -> int:
        raise OperationalError("BEGIN", {}, Exception("the database is away"))

    with monkeypatch.context() as patched:
        patched.setattr(Reconciler, "take_back_all", fail)
        with pytest.raises(OperationalError):
            watch.monitor.take_back_if_wiped(now_s=watch.farm.now_s)
    assert watch.monitor.take_back_if_wiped(now_s=watch.farm.now_s) > 0
    assert watch.farm.task(order).status is TaskStatus.READY


def test_nothing_is_judged_while_events_are_not_read(watch: Watch) -> None:
    running(watch)
    watch.look(worker("i2", seen_s=104.0))
    watch.liveness.record_gap()
    assert watch.monitor.run([worker("i2", seen_s=104.0)], {"": None}, now_s=watch.farm.now_s) == 0


def test_a_new_leader_forgets_what_an_earlier_one_saw(watch: Watch) -> None:
    running(watch)
    returned = worker("i2", seen_s=104.0)
    watch.look(returned)
    watch.monitor.begin(now_s=watch.farm.now_s)
    assert watch.look(returned) == 0
    assert watch.look(returned) == 1


def test_the_first_order_of_the_queue_is_the_one_that_was_sent_first(watch: Watch) -> None:
    watch.farm.planned()
    orders = watch.farm.dispatch()
    watch.queue.publish(orders)
    assert attempt_of(watch.stream.first_order()) == orders[0].attempt
    assert (attempt_of(None), attempt_of(b"nonsense")) == (None, "")
