"""An attempt while the broker is unreachable: it waits before it begins, and it keeps its final event."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from redis import Redis
from redis.exceptions import RedisError

from lippmann.job.messages import wire
from lippmann.job.messages.events import Event, EventKind
from lippmann.job.messages.orders import Order, TaskKind
from tests.broker import Broker
from tests.builders_messages import SEALS, seals_in
from tests.tcp_proxy import TcpProxy, tcp_proxy
from tests.waiting import ENOUGH_S, until
from worker.report import BrokerClient
from worker.sandbox.sandbox import Sandbox
from worker.settings import WorkerSettings
from worker.tasks.attempts.attempt import TaskResult, attempt
from worker.tasks.attempts.monitor import ProgressMonitor
from worker.tasks.attempts.workplace import Workplace

ORDER = Order(kind=TaskKind.PROBE, job_id="j", task_id="t", attempt="a1", attempt_number=1)


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


@pytest.fixture
def proxy(broker: Broker) -> Iterator[TcpProxy]:
    with tcp_proxy(("127.0.0.1", broker.port)) as proxy:
        yield proxy


@pytest.fixture
def place(proxy: TcpProxy, tmp_path: Path) -> Workplace:
    seals_in(tmp_path)
    settings = WorkerSettings(redis_url=url_of(proxy), data_dir=tmp_path, worker_name="w1")
    settings.scratch_dir.mkdir(parents=True)
    return Workplace(settings=settings, sandbox=Sandbox("none"))


def url_of(proxy: TcpProxy) -> str:
    assert isinstance(proxy.address, tuple)
    return f"redis://{proxy.address[0]}:{proxy.address[1]}/0"


def published(redis: Redis) -> list[EventKind]:
    entries: Any = redis.xrange(wire.EVENTS_STREAM)
    return [Event.model_validate_json(fields[b"event"]).kind for _, fields in entries]


class Work:
    """A task that waits until the test lets it end, and the thread in which its attempt runs."""

    def __init__(self, place: Workplace) -> None:
        self.begun, self.may_end = threading.Event(), threading.Event()
        self.thread = threading.Thread(target=attempt, args=(place, ORDER, self), daemon=True)
        self.thread.start()

    def __call__(self, place: Workplace, order: Order, monitor: ProgressMonitor) -> TaskResult:
        self.begun.set()
        assert self.may_end.wait(ENOUGH_S)
        return TaskResult()


def test_the_final_event_is_kept_until_the_broker_is_back(place: Workplace, proxy: TcpProxy, broker: Broker) -> None:
    work = Work(place)
    assert work.begun.wait(ENOUGH_S)
    proxy.refuse()
    work.may_end.set()
    work.thread.join(3.0)
    assert work.thread.is_alive(), "the slot waits"
    proxy.pass_on()
    work.thread.join(ENOUGH_S)
    assert published(broker.client)[-1] is EventKind.DONE


def test_a_final_event_that_nobody_takes_does_not_hold_up_the_stop_of_the_worker(
    place: Workplace, proxy: TcpProxy, broker: Broker
) -> None:
    work = Work(place)
    assert work.begun.wait(ENOUGH_S)
    proxy.blackhole()
    work.may_end.set()
    place.settings.stopping_file.touch()
    begun_s = time.monotonic()
    work.thread.join(place.settings.final_event_s / 2)
    assert not work.thread.is_alive()
    assert time.monotonic() - begun_s < place.settings.final_event_s / 4


def test_an_attempt_begins_when_the_broker_is_back(place: Workplace, proxy: TcpProxy, broker: Broker) -> None:
    proxy.refuse()
    work = Work(place)
    assert not work.begun.wait(3.0)
    assert work.thread.is_alive(), "the order is not lost"
    proxy.pass_on()
    assert work.begun.wait(ENOUGH_S)
    work.may_end.set()
    until(lambda: EventKind.DONE in published(broker.client))


def test_a_lease_whose_answer_was_lost_is_recognised_by_the_next_try_and_by_no_other_delivery(
    proxy: TcpProxy, broker: Broker
) -> None:
    client = BrokerClient(url_of(proxy), "w1", "i1", seals=SEALS, timeout_s=3.0)
    earlier = ORDER.model_copy(update={"attempt": "a0"})
    assert client.claim(earlier, client.new_lease("a0")), "from now on the broker has the script"
    proxy.blackhole("answers")
    lease = client.new_lease("a1")
    with pytest.raises(RedisError):
        client.claim(ORDER, lease)
    assert until(lambda: broker.client.get(wire.lease_key("a1"))) == lease.encode(), "the broker has the first try"
    proxy.pass_on()
    assert client.claim(ORDER, lease)
    assert not client.claim(ORDER, client.new_lease("a1"))
