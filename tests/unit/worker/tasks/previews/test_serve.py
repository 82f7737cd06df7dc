"""The process that renders previews: what it takes, what it stops, and what it answers."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from pathlib import Path

import pytest

from lippmann.job.messages import wire
from lippmann.job.messages.previews import PreviewAnswer, PreviewOrder
from tests.broker import Broker
from tests.builders import local_place
from tests.builders_messages import SEALS
from tests.unit.service.previews.test_choose import job
from tests.waiting import until
from worker.preview_orders import PreviewOrders
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.previews import serve
from worker.tasks.previews.serve import PreviewServer, WantedMonitor


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    broker = Broker(tmp_path_factory.mktemp("broker"))
    yield broker
    broker.kill()


@pytest.fixture
def orders(broker: Broker) -> Iterator[PreviewOrders]:
    orders = PreviewOrders(broker.url, "w1", None, seals=SEALS)
    yield orders
    orders.close()
    broker.client.flushall()


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Workplace:
    return local_place(tmp_path_factory.mktemp("farm"))


def sent(broker: Broker, *, is_wanted: bool = True) -> PreviewOrder:
    """Send an order as the service does; its bundle is not in the store of the worker."""
    order = PreviewOrder(id=secrets.token_hex(16), worker="w1", job=job(), frame=1, timeout_s=9)
    if is_wanted:
        broker.client.set(wire.preview_wanted_key(order.id), "1")
    broker.client.lpush(wire.preview_orders_key("w1"), SEALS.sealed_preview_order(order))
    return order


def test_a_store_that_is_away_is_answered_and_the_process_goes_on(
    broker: Broker, orders: PreviewOrders, tmp_path: Path
) -> None:
    place = local_place(tmp_path)
    place.settings.artifacts_dir.write_text("in the way")
    failure = PreviewServer(place, orders).answer_to(sent(broker)).failure
    assert failure is not None
    assert failure.code == "store-unavailable"


def test_an_order_that_nobody_waits_for_is_skipped(broker: Broker, orders: PreviewOrders) -> None:
    sent(broker, is_wanted=False)
    wanted = sent(broker)
    assert orders.take(0.1) is None
    assert orders.take(0.1) == wanted
    assert not orders.are_waiting()


def test_an_order_for_another_worker_is_refused(broker: Broker, orders: PreviewOrders) -> None:
    order = sent(broker)
    broker.client.rename(wire.preview_orders_key("w1"), wire.preview_orders_key("w2"))
    assert PreviewOrders(broker.url, "w2", None, seals=SEALS).take(0.1) is None
    assert orders.is_wanted(order.id)


def test_a_long_preview_stops_when_nobody_waits_and_a_short_one_ends(
    broker: Broker, orders: PreviewOrders, place: Workplace, monkeypatch: pytest.MonkeyPatch
) -> None:
    order = sent(broker)
    monkeypatch.setattr(serve, "ASK_S", 0.0)
    short = WantedMonitor(orders, order.id, place, limit_s=600)
    monkeypatch.setattr(serve, "LET_FINISH_S", 0.0)
    long = WantedMonitor(orders, order.id, place, limit_s=600)
    assert not long.should_stop()
    broker.client.delete(wire.preview_wanted_key(order.id))
    assert long.should_stop()
    monkeypatch.setattr(serve, "LET_FINISH_S", 60.0)
    assert not short.should_stop()


def test_a_preview_that_somebody_waits_for_has_a_limit_too(
    broker: Broker, orders: PreviewOrders, place: Workplace
) -> None:
    order = sent(broker)
    assert WantedMonitor(orders, order.id, place, limit_s=0.0).should_stop()
    assert not WantedMonitor(orders, order.id, place, limit_s=600).should_stop()


def test_a_preview_ends_with_its_worker(broker: Broker, orders: PreviewOrders, tmp_path: Path) -> None:
    place = local_place(tmp_path)
    monitor = WantedMonitor(orders, sent(broker).id, place, limit_s=600)
    assert not monitor.should_stop()
    place.settings.stopping_file.parent.mkdir(parents=True, exist_ok=True)
    place.settings.stopping_file.touch()
    assert monitor.should_stop()


def test_a_preview_that_fails_is_answered_and_the_next_one_is_taken(
    broker: Broker, orders: PreviewOrders, place: Workplace
) -> None:
    first, second = sent(broker), sent(broker)
    PreviewServer(place, orders).serve(idle_s=0.3)
    for order in (first, second):
        text = broker.client.rpop(wire.preview_answer_key(order.id))
        assert isinstance(text, bytes)
        answer = SEALS.open_preview_answer(text, preview=order.id, worker="w1")
        assert answer.made is None
        assert answer.failure is not None
        assert answer.failure.code == "artifact-missing"


def test_an_answer_expires(broker: Broker, orders: PreviewOrders) -> None:
    answer = PreviewAnswer(id="0" * 32, worker="w1")
    orders.answer(answer)
    key = wire.preview_answer_key(answer.id)
    assert 0 < broker.client.pttl(key) <= 1000 * wire.PREVIEW_TTL_S
    broker.client.pexpire(key, 1)
    until(lambda: not broker.client.exists(key))
