"""The consumer while the broker is away, and with a user of the broker that has fewer rights."""

from __future__ import annotations

import logging
import signal
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from celery import Celery
from celery.exceptions import WorkerShutdown
from celery.worker import state
from structlog.testing import capture_logs

from lippmann.job.messages import wire
from lippmann.job.messages.events import Directions
from lippmann.job.messages.protocol import OLDEST_PROTOCOL, PROTOCOL
from tests.broker import Broker
from tests.builders_messages import SEALS
from tests.builders_service import presence
from tests.repository import ROOT
from worker.consumer import SILENT_S, NotPolling, OrderConsumer
from worker.drain_signals import drain_by_signals
from worker.duty import SETTLED_TICKS, Duty
from worker.handover import Handover
from worker.liveness import ConsumerLiveness
from worker.report import BrokerClient

NOWHERE = "redis://127.0.0.1:1/0"
NO_CONTROLLER = SimpleNamespace(use_eventloop=False)


class FewRefusals(ConsumerLiveness):
    """A record that ends the test when the consumer has waited for the broker longer than it should."""

    def record_refusal(self) -> None:
        super().record_refusal()
        assert self.signs <= 2 * SETTLED_TICKS, "the consumer waits for the broker"


def consumer(duty: Duty, find: Callable[[], Directions | None] = lambda: None) -> OrderConsumer:
    broker = BrokerClient(NOWHERE, "w1", seals=SEALS)
    liveness = FewRefusals(broker, presence(), None)
    app = Celery(broker=NOWHERE, set_as_current=False)
    return OrderConsumer(
        liveness, Handover(), 1, duty, find, print, on_task_request=print, app=app, controller=NO_CONTROLLER
    )


@pytest.fixture
def _ends_by_sigterm(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let SIGTERM do what it does in a worker of Celery."""
    monkeypatch.setattr(state, "should_stop", None)
    before = {number: signal.getsignal(number) for number in (signal.SIGTERM, signal.SIGUSR1)}
    signal.signal(signal.SIGTERM, lambda *_: setattr(state, "should_stop", 0))
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("_ends_by_sigterm")
def test_a_drained_worker_without_attempts_ends_while_the_broker_is_away() -> None:
    duty = Duty(presence())
    drain_by_signals(duty, drain_s=3600, is_refused=lambda: False)
    signal.raise_signal(signal.SIGTERM)
    assert state.should_stop is None, "the first SIGTERM only drains"
    tried = consumer(duty)
    with capture_logs() as logs, pytest.raises(WorkerShutdown):
        tried.ensure_connected(tried.app.connection_for_read())
    assert "takes no orders" in [entry["event"] for entry in logs], "the drain is logged without a tick"


def test_a_silent_broker_is_noticed_by_time_though_each_tick_waits_for_it_and_a_stop_of_the_process_is_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now_s = [100.0]
    monkeypatch.setattr("worker.consumer.monotonic", lambda: now_s[0])
    tried = consumer(Duty(presence()))
    tried.pool = SimpleNamespace(num_processes=4, maintain_pool=lambda: None)

    def wait(held: int) -> None:
        now_s[0] += 5.0  # the time after which the question for the directions ends without an answer

    now_s[0] += 600.0  # The process stood still.
    monkeypatch.setattr(tried, "_follow_directions", lambda held: None)
    tried._tick()
    tried._record_poll()
    monkeypatch.setattr(tried, "_follow_directions", wait)
    silent_s = now_s[0]
    with pytest.raises(NotPolling, match="within 10 s"):
        deque(iter(tried._tick, "never"))
    assert now_s[0] - silent_s <= SILENT_S + 5.0


def test_a_user_of_an_older_version_is_named_once_until_it_may_read_the_directions(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    line = (ROOT / "deploy/broker-users.acl").read_text().splitlines()[-1].replace("#WORKER_SHA256", ">word")
    _, name, *rights = line.split()
    right = "%R~lippmann:directions"
    server = Broker(tmp_path)
    try:
        said = Directions(release="1.0", protocol=PROTOCOL, oldest_protocol=OLDEST_PROTOCOL)
        server.client.set(wire.DIRECTIONS, SEALS.sealed_directions(said))

        def renew(rights: list[str]) -> None:
            server.client.execute_command("ACL", "SETUSER", name, "reset", *rights)

        renew([each for each in rights if each != right])
        url = server.url.replace("//", f"//{name}:word@")
        tried = consumer(Duty(presence()), BrokerClient(url, "w1", seals=SEALS).directions)

        def errors() -> list[Any]:
            return [record for record in caplog.records if record.levelno == logging.ERROR]

        assert (tried.read_directions(), tried.read_directions()) == (None, None)
        (error,) = errors()
        assert "deploy/broker-users.acl" in error.getMessage()
        renew(rights)
        assert tried.read_directions() == said
    finally:
        server.kill()
    assert tried.read_directions() is None, "a broker that is away is no reason to end"
    assert len(errors()) == 1
