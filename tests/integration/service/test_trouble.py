"""What happens to jobs and requests when the broker or a leader goes away."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from lippmann.job.messages import wire
from lippmann.job.messages.events import Event, NotClaiming
from lippmann.job.messages.orders import Order, TaskKind
from service.broker_stream import Stream
from service.coordinator.coordinator import Coordinator
from service.db.tables import CoordinatorRow
from service.errors import BrokerUnavailable
from service.order_queue import OrderQueue
from tests.broker import Broker
from tests.builders_messages import SEALS, put_presence, seals_in
from tests.builders_service import SPEC, claimed, done, parts, presence
from tests.integration.service.conftest import ORDERS, FakeWorker, Service
from tests.waiting import ENOUGH_S, until


def _submit(service: Service, **changes: Any) -> str:
    answer = service.client.post("/jobs", json=SPEC | changes)
    assert answer.status_code == 201, answer.text
    return str(answer.json()["id"])


@pytest.fixture
def half_open() -> Iterator[str]:
    """Lend the URL of a broker that takes connections and never says a word."""
    with socket.socket() as deaf:
        deaf.bind(("127.0.0.1", 0))
        deaf.listen(50)
        yield f"redis://127.0.0.1:{deaf.getsockname()[1]}/0"


@pytest.mark.parametrize("wipe", ["flush", "restart"])
def test_a_job_ends_with_each_frame_once_though_the_broker_is_wiped_in_its_middle(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker], broker: Broker, wipe: str
) -> None:
    service = make_service(unclaimed_s=1e6, lease_ttl_s=3.0)  # no order is sent again because it was not claimed
    frames, wiped = 12, threading.Event()

    def answer(order: Order) -> list[Event]:
        if order.kind is TaskKind.ASSEMBLE and order.frame == 4 and not wiped.is_set():
            wiped.set()
            if wipe == "flush":
                broker.client.flushall()
            else:
                broker.kill()
                broker.start()
        return [claimed(order), done(order)]

    worker = make_worker(answer, lists=True)
    job_id = _submit(service, frames=f"1-{frames}")
    until(lambda: service.status(job_id) == "done")
    assert wiped.is_set()
    job = service.client.get(f"/jobs/{job_id}").json()
    assert (job["frames_done"], job["tasks"]["done"], job["progress"]) == (frames, 2 + 3 * frames, 1.0)
    assert len(worker.orders) >= 2 + 3 * frames


def test_a_job_goes_on_after_the_service_was_stopped_in_its_middle(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker]
) -> None:
    given = parts()
    first = make_service(given)
    gate = threading.Event()

    def answer(order: Order) -> list[Event]:
        if order.frame == 3:
            gate.wait(ENOUGH_S)
        return [claimed(order), done(order)]

    make_worker(answer)
    job_id = _submit(first)
    until(lambda: first.client.get(f"/jobs/{job_id}").json()["tasks"]["done"] >= 4)
    first.stop()
    gate.set()
    second = make_service(given)
    until(lambda: second.status(job_id) == "done")
    tasks = second.client.get(f"/jobs/{job_id}/tasks").json()["items"]
    assert [task["attempt_number"] for task in tasks] == [1] * 11


@pytest.mark.parametrize("broken", ["dead", "half open"])
def test_health_answers_and_says_what_is_wrong(
    make_service: Callable[..., Service], half_open: str, broken: str
) -> None:
    service = make_service(redis_url=half_open if broken == "half open" else "redis://127.0.0.1:1/0")
    until(lambda: service.client.get("/health").json()["coordinator"]["ok"])
    answer = service.client.get("/health", headers={"Authorization": ""})
    health = answer.json()
    assert (answer.status_code, health["status"], health["broker"]["ok"]) == (200, "degraded", False)
    assert (health["database"]["ok"], health["store"]["ok"], health["workers"]) == (True, True, None)
    assert health["store"]["free_bytes"] is None  # without a key
    assert service.client.get("/health").json()["store"]["free_bytes"] > 0


@pytest.mark.parametrize("broken", ["dead", "half open"])
def test_every_request_is_answered_while_the_broker_is_away(
    make_service: Callable[..., Service], half_open: str, broken: str
) -> None:
    service = make_service(redis_url=half_open if broken == "half open" else "redis://127.0.0.1:1/0")
    job_id = _submit(service)
    assert service.status(job_id) == "queued"
    assert service.client.get("/workers").json() == {"items": [], "known": False, "excluded": []}
    for path in (f"/jobs/{job_id}/tasks", f"/jobs/{job_id}/frames", "/jobs", "/scenes"):
        assert service.client.get(path).status_code == 200
    assert service.client.post(f"/jobs/{job_id}/cancel").json()["status"] == "cancelled"
    assert service.client.delete(f"/jobs/{job_id}").status_code == 204
    service.stop()


def test_publishing_to_a_half_open_broker_ends_by_itself(half_open: str) -> None:
    queue = OrderQueue(half_open, seals=SEALS, timeout_s=0.3)
    order = Order(kind=TaskKind.PROBE, job_id="j", task_id="j-0", attempt="a", attempt_number=1)
    with pytest.raises(BrokerUnavailable):
        queue.publish([order])


def test_publishing_to_a_broker_that_froze_after_the_connection_ends_by_itself(broker: Broker) -> None:
    queue = OrderQueue(broker.url, seals=SEALS, timeout_s=3)
    order = Order(kind=TaskKind.PROBE, job_id="j", task_id="j-0", attempt="a", attempt_number=1)
    queue.publish([order])
    broker.freeze()
    with pytest.raises(BrokerUnavailable):
        queue.publish([order])
    broker.thaw()
    queue.publish([order])


def test_the_queue_sends_orders_to_a_broker_that_was_restarted(broker: Broker) -> None:
    queue = OrderQueue(broker.url, seals=SEALS, timeout_s=30)
    order = Order(kind=TaskKind.PROBE, job_id="j", task_id="j-0", attempt="a", attempt_number=1)
    queue.publish([order, order])
    assert broker.client.llen(ORDERS) == 2
    broker.kill()
    with pytest.raises(BrokerUnavailable):
        queue.publish([order])
    broker.start()
    queue.publish([order])
    broker.kill()
    broker.start()
    queue.publish([order])
    assert broker.client.llen(ORDERS) == 1, "a connection that the broker closed is noticed before it is used"


def test_the_stream_gives_up_on_a_half_open_broker(half_open: str) -> None:
    stream = Stream(half_open, seals=SEALS, timeout_s=0.3)
    for ask in (stream.presences, stream.ping, stream.is_new, lambda: stream.read("0-0", count=1, block_s=0.1)):
        with pytest.raises(BrokerUnavailable):
            ask()


def test_workers_that_are_there_are_shown_with_what_they_run(
    service: Service, broker: Broker, make_worker: Callable[..., FakeWorker]
) -> None:
    make_worker(lambda order: [claimed(order)])
    _submit(service)
    (worker,) = until(lambda: [w for w in service.client.get("/workers").json()["items"] if w["running"]])
    assert (worker["name"], worker["slots"], worker["running"]) == ("w1", 2, 1)
    health = service.client.get("/health").json()
    assert (health["slots"], health["sandboxes"]) == (2, [worker["sandbox"]])
    assert service.client.get("/health", headers={"Authorization": ""}).json()["sandboxes"] is None


def test_a_worker_that_takes_no_orders_is_named_and_its_slots_do_not_count(
    make_service: Callable[..., Service], broker: Broker, make_worker: Callable[..., FakeWorker], tmp_path: Path
) -> None:
    service = make_service(not_claiming_s=1.0)
    deaf = presence("deaf").model_copy(update={"holds": ()})
    put_presence(broker.client, deaf, seals_in(tmp_path))
    until(lambda: service.client.get("/health").json()["slots"] == 2)
    job_id = _submit(service)
    health = until(lambda: (seen := service.client.get("/health").json())["faults"] and seen)
    (fault,) = health["faults"]
    assert (fault["code"], fault["message"].split(":")[0]) == ("not-claiming", "deaf")
    assert (health["status"], health["workers"], health["slots"]) == ("degraded", 1, 0)
    (worker,) = service.client.get("/workers").json()["items"]
    assert worker["not_claiming_since_s"] > 0
    make_worker()
    until(lambda: service.status(job_id) == "done")
    until(lambda: service.client.get("/health").json()["faults"] == [])


def test_a_cancelled_attempt_finds_a_signed_stop_signal(
    service: Service, broker: Broker, make_worker: Callable[..., FakeWorker], tmp_path: Path
) -> None:
    worker = make_worker(lambda order: [claimed(order)])
    job_id = _submit(service)
    until(lambda: service.client.get(f"/jobs/{job_id}").json()["tasks"]["running"] == 1)
    service.client.post(f"/jobs/{job_id}/cancel")
    until(lambda: broker.client.exists(wire.stop_key(worker.orders[0].attempt)))
    (cancelled,) = worker.orders
    assert 0 < broker.client.ttl(wire.stop_key(cancelled.attempt)) <= wire.STOP_TTL_S
    text: Any = broker.client.get(wire.stop_key(cancelled.attempt))
    seals_in(tmp_path).check_stop(text, attempt=cancelled.attempt)


def test_of_two_coordinators_one_leads_and_the_other_takes_over_when_it_stops(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker]
) -> None:
    given = parts()
    first, second = make_service(given), make_service(given)
    leader = until(lambda: first.client.get("/health").json()["coordinator"]["leader"])
    assert second.client.get("/health").json()["coordinator"]["leader"] == leader
    make_worker()
    first.stop()
    job_id = _submit(second)
    until(lambda: second.status(job_id) == "done")
    assert second.client.get("/health").json()["coordinator"]["leader"] not in (None, leader)


def test_a_leader_that_fell_silent_is_replaced_after_its_time_and_knows_that_it_no_longer_leads(
    make_service: Callable[..., Service],
) -> None:
    service = make_service(coordinator=False)
    settings = service.settings.model_copy(update={"leader_ttl_s": 5.0})
    state = service.state
    old, new = (Coordinator(state.database, state.parts.store, settings, state.wakeup) for _ in range(2))
    old.election_round()
    new.election_round()
    assert (old.election.is_leader, new.election.is_leader) == (True, False)

    def new_leads() -> bool:
        new.election_round()
        return new.election.is_leader

    until(new_leads)
    old.election_round()
    assert (old.election.is_leader, new.election.is_leader) == (False, True)
    with state.database.reading() as session:
        assert session.get_one(CoordinatorRow, 1).leader == new.election.name
    new.stop()
    old.election_round()
    assert (old.election.is_leader, new.election.is_leader) == (True, False)
    old.stop()


def test_orders_travel_as_celery_carries_them(broker: Broker) -> None:
    import base64
    import json

    order = Order(kind=TaskKind.RENDER, job_id="j", task_id="j-3", attempt="abc", attempt_number=2, avoid=("w1",))
    queue = OrderQueue(broker.url, seals=SEALS, timeout_s=30)
    queue.publish([order])
    queue.close()
    message = json.loads(broker.client.lpop(ORDERS))
    assert message["headers"]["task"] == wire.task_name(TaskKind.RENDER)
    assert message["headers"]["ignore_result"] is True
    args, kwargs, _ = json.loads(base64.b64decode(message["body"]))
    opened = SEALS.open_order(kwargs["order"], kind=order.kind, attempt=message["headers"]["id"], now_s=time.time())
    assert (args, opened) == ([], order)


@pytest.mark.promise("Between processes", "Events and presences that are not signed are dropped and counted.")
def test_presences_that_cannot_be_understood_are_passed_over(broker: Broker, tmp_path: Path) -> None:
    broker.client.set(wire.presence_key("x"), "nonsense")
    for name in ("b", "a"):
        put_presence(broker.client, presence(name), SEALS)
    broker.client.xadd(wire.EVENTS_STREAM, {"other": "nonsense"})
    stream = Stream(broker.url, seals=SEALS, timeout_s=30)
    assert [worker.name for worker in stream.presences()] == ["a", "b"]
    assert [event for _, event in stream.read("0-0", count=9, block_s=0.1)] == [None]
    broker.client.set(wire.NOT_CLAIMING, '{"a": 1.0}')
    assert stream.not_claiming() == {}
    broker.client.set(wire.NOT_CLAIMING, SEALS.sealed_not_claiming(NotClaiming(since_s={"a": 1.0})))
    assert stream.not_claiming() == {"a": 1.0}
    assert stream.dropped == {"presence": 1, "event": 1, "not-claiming": 1}


def test_health_tells_an_admin_how_many_messages_were_refused(
    broker: Broker, make_service: Callable[..., Service], tmp_path: Path
) -> None:
    service = make_service()
    broker.client.xadd(wire.EVENTS_STREAM, {"other": "nonsense"})
    broker.client.set(wire.presence_key("x"), "nonsense")
    worker = presence("w").model_copy(update={"refused_orders": 4})
    put_presence(broker.client, worker, seals_in(tmp_path), ex=600)

    def is_told() -> bool:
        dropped = service.client.get("/health").json()["dropped"]
        # A new broker is read from its beginning, so a service that has read the event already counts it twice.
        return (dropped["events"] > 0, dropped["presences"] > 0, dropped["orders"]) == (True, True, 4)

    until(is_told)


def test_a_broker_on_a_unix_socket_is_the_same_broker(broker: Broker) -> None:
    order = Order(kind=TaskKind.PROBE, job_id="j", task_id="j-0", attempt="a", attempt_number=1)
    queue = OrderQueue(broker.unix_url, seals=SEALS, timeout_s=30)
    queue.publish([order])
    queue.close()
    assert broker.client.llen(ORDERS) == 1
    stream = Stream(broker.unix_url, seals=SEALS, timeout_s=30)
    assert stream.is_new()
    stream.mark()
    assert not Stream(broker.url, seals=SEALS, timeout_s=30).is_new()
    stream.stop(["a"], ttl_s=60)
    assert broker.client.exists(wire.stop_key("a"))
