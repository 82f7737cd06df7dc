"""A real broker, a real database of each kind, and a service that listens."""

from __future__ import annotations

import asyncio
import base64
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
import redis

from lippmann.job.messages import wire
from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.messages.seals import Seals
from service.auth import create_key
from service.main import Server, create_app
from service.ports import Parts
from service.schemas.access import Role
from service.settings import Settings
from tests.broker import Broker
from tests.builders_messages import add_event, put_presence, seals_in
from tests.builders_service import claimed, done, parts, presence
from tests.postgresql import new_database
from tests.postgresql import postgresql as postgresql
from tests.waiting import ENOUGH_S, until

ORDERS = wire.CARRIER_PREFIX + wire.QUEUE
"""The list in which Celery keeps orders."""


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.thaw()
    broker.kill()


class FakeWorker:
    """Takes orders from the queue as Celery put them there, and says what the test wants said of each."""

    def __init__(
        self, broker: Broker, seals: Seals, answer: Callable[[Order], list[Event]], *, name: str = "w1",
        lists: bool = False,
    ) -> None:  # fmt: skip
        self.orders: list[Order] = []
        self._broker, self._seals, self._answer = broker, seals, answer
        # A worker that lists what it holds, which is nothing: it answers each order at once.
        self._presence = presence(name).model_copy(update={"holds": () if lists else None})
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        self._thread.join(ENOUGH_S)

    def _run(self) -> None:
        client = self._broker.client
        while not self._stopping.is_set():
            try:
                put_presence(client, self._presence, self._seals, ex=20)
                message = client.brpop([ORDERS], timeout=0.2)  # the end that Celery takes from: first in, first out
                if message is not None:
                    self._do(client, message[1])
            except redis.RedisError:
                self._stopping.wait(0.1)

    def _do(self, client: Any, message: bytes) -> None:
        body = json.loads(base64.b64decode(json.loads(message)["body"]))
        envelope = json.loads(message)["headers"]
        kind = TaskKind(envelope["task"].removeprefix("lippmann."))
        order = self._seals.open_order(body[1]["order"], kind=kind, attempt=envelope["id"], now_s=time.time())
        if client.exists(wire.stop_key(order.attempt)):
            return
        self.orders.append(order)
        for event in self._answer(order):
            add_event(client, event, self._seals)


def at_once(order: Order) -> list[Event]:
    return [claimed(order), done(order)]


@pytest.fixture
def make_worker(broker: Broker, tmp_path: Path) -> Iterator[Callable[..., FakeWorker]]:
    made: list[FakeWorker] = []

    def make(answer: Callable[[Order], list[Event]] = at_once, *, data_dir: Path = tmp_path, **more: Any) -> FakeWorker:
        made.append(FakeWorker(broker, seals_in(data_dir), answer, **more))
        return made[-1]

    yield make
    for worker in made:
        worker.stop()


class Service:
    """A service that listens on loopback in a thread of its own, and a client with an admin's key."""

    def __init__(self, settings: Settings, given: Parts) -> None:
        self.settings, self.parts = settings, given
        self.app = create_app(settings, given)
        self.state = self.app.state.lippmann
        self._socket = socket.socket()
        self._socket.bind(("127.0.0.1", 0))
        self.url = f"http://127.0.0.1:{self._socket.getsockname()[1]}"
        self.server = Server(self.app, host="127.0.0.1", port=0)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        until(lambda: self.server.started or not self._thread.is_alive())
        assert self.server.started
        self.client = httpx.Client(base_url=f"{self.url}/api/v1", timeout=ENOUGH_S)
        self.client.headers["Authorization"] = f"Bearer {self.new_key(Role.ADMIN)}"

    def _run(self) -> None:
        asyncio.run(self.server.serve(sockets=[self._socket]))

    def new_key(self, role: Role) -> str:
        with self.state.database.writing() as session:
            return create_key(session, f"a {role}", role, owner_id="tester")[1]

    def status(self, job_id: str) -> str:
        return str(self.client.get(f"/jobs/{job_id}").json()["status"])

    def stop(self) -> None:
        self.client.close()
        self.server.should_exit = True
        self._thread.join(ENOUGH_S)
        assert not self._thread.is_alive()


@pytest.fixture
def make_service(tmp_path: Path, broker: Broker) -> Iterator[Callable[..., Service]]:
    made: list[Service] = []

    def make(given: Parts | None = None, **settings: Any) -> Service:
        quick = {"reconcile_s": 0.2, "tick_s": 0.05, "retry_pause_s": 0.0}
        chosen: dict[str, Any] = {"data_dir": tmp_path, "redis_url": broker.url, **quick, **settings}
        made.append(Service(Settings(**chosen), given or parts()))
        return made[-1]

    yield make
    for service in made:
        if not service.server.should_exit:
            service.stop()


@pytest.fixture
def service(make_service: Callable[..., Service]) -> Service:
    return make_service()


@pytest.fixture
def postgresql_url(postgresql: str) -> Iterator[str]:
    """Lend the URL of a database of the test's own."""
    with new_database(postgresql) as url:
        yield url


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "postgresql":
        return str(request.getfixturevalue("postgresql_url"))
    return f"sqlite:///{tmp_path}/test.db"
