"""The signs of life of a worker: who gives them, and what happens when nobody does."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lippmann.job.messages import wire
from lippmann.job.messages.events import Presence
from tests.broker import Broker
from tests.builders_messages import SEALS
from tests.builders_service import presence
from tests.waiting import ENOUGH_S
from worker.liveness import EXIT_STUCK, ConsumerLiveness
from worker.report import BrokerClient

STUCK = """
import sys, threading
from pathlib import Path
from tests.builders_messages import SEALS
from tests.builders_service import presence
from worker.liveness import ConsumerLiveness, StuckWatch
from worker.report import BrokerClient
liveness = ConsumerLiveness(BrokerClient("redis://127.0.0.1:1/0", "w1", seals=SEALS), presence(), None)
StuckWatch(liveness, Path(sys.argv[1]), stuck_s=3.0, stop_s=1.0).start()
for _ in range(int(sys.argv[2])):
    liveness.record_refusal()
    threading.Event().wait(1.0)
print("the signs end", flush=True)
threading.Event().wait(600)
"""


SEIZED = """
import os, sys, threading
from pathlib import Path
from types import SimpleNamespace
import lippmann.logs
from worker.liveness import StuckWatch
lippmann.logs.configure_logs(sys.stderr)
stopping, fault = Path(sys.argv[1]), sys.argv[2]
if fault == "a log that hangs":
    lippmann.logs._writing.acquire()
elif fault == "a disk that hangs":
    os.mkfifo(stopping)  # Nobody reads it.
    Path.touch = lambda path: path.open("w")
StuckWatch(SimpleNamespace(signs=0), stopping, stuck_s=0.0, stop_s=1.0).start()
threading.Event().wait(600)
"""


@pytest.fixture(scope="module")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    broker = Broker(tmp_path_factory.mktemp("broker"))
    yield broker
    broker.kill()


@pytest.fixture
def heartbeat_file(tmp_path: Path) -> Path:
    return tmp_path / "heartbeat"


class Clock:
    now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


def published(broker: Broker) -> Presence | None:
    text: Any = broker.client.getdel(wire.presence_key("w1"))
    return Presence.model_validate_json(text) if text else None


def test_the_heartbeat_file_is_touched_by_polls_and_refusals_and_not_by_the_presence(
    broker: Broker, heartbeat_file: Path
) -> None:
    liveness = ConsumerLiveness(BrokerClient(broker.url, "w1", seals=SEALS), presence(), heartbeat_file)
    liveness.publish(holds=())
    assert not heartbeat_file.exists()
    for record in (liveness.record_poll, liveness.record_refusal):
        record()
        assert heartbeat_file.exists()
        heartbeat_file.unlink()


def test_the_presence_says_when_the_consumer_last_polled_and_took_an_order(broker: Broker) -> None:
    clock = Clock()
    liveness = ConsumerLiveness(BrokerClient(broker.url, "w1", seals=SEALS), presence(), None, clock=clock)
    liveness.publish(holds=())
    seen = published(broker)
    assert seen is not None
    assert (seen.consuming_s, seen.order_s, seen.holds) == (None, None, ())
    liveness.record_poll()
    clock.now_s += 2.0
    liveness.record_order()
    clock.now_s += 1.0
    liveness.publish(holds=("a1",))
    seen = published(broker)
    assert seen is not None
    assert (seen.consuming_s, seen.order_s, seen.seen_s, seen.holds) == (1000.0, 1002.0, 1003.0, ("a1",))


def test_the_presence_is_published_every_few_seconds_and_when_the_orders_change(broker: Broker) -> None:
    clock = Clock()
    liveness = ConsumerLiveness(BrokerClient(broker.url, "w1", seals=SEALS), presence(), None, clock=clock)
    liveness.publish(holds=())
    assert published(broker)
    liveness.publish(holds=())
    assert published(broker) is None
    liveness.publish(holds=("a1",))
    assert published(broker)
    clock.now_s += wire.HEARTBEAT_S + 0.1
    liveness.publish(holds=("a1",))
    assert published(broker)
    clock.now_s -= 5000.0  # the clock is set back
    liveness.publish(holds=("a1",))
    assert published(broker)


def test_a_worker_whose_consumer_gives_no_sign_ends_with_a_message_after_its_attempts(tmp_path: Path) -> None:
    ran = subprocess.run(
        [sys.executable, "-c", STUCK, str(tmp_path / "stopping"), "6"], capture_output=True, text=True, timeout=ENOUGH_S
    )
    assert ran.returncode == EXIT_STUCK
    before, _, after = ran.stdout.partition("the signs end")
    assert "got no sign of it" not in before, "refusals of the broker are signs"
    assert "expected the consumer to poll the broker, got no sign of it for 3 s" in after
    assert not (tmp_path / "stopping").exists()


@pytest.mark.parametrize("fault", ["a log that hangs", "a disk that hangs", "a folder that is gone"])
def test_a_worker_that_is_stuck_ends_though_the_log_or_the_disk_is_the_fault(tmp_path: Path, fault: str) -> None:
    stopping_file = tmp_path / "gone/stopping" if "gone" in fault else tmp_path / "stopping"
    ran = subprocess.run(
        [sys.executable, "-c", SEIZED, str(stopping_file), fault], capture_output=True, text=True, timeout=ENOUGH_S
    )
    assert ran.returncode == EXIT_STUCK
    assert ("got no sign of it" in ran.stderr) == ("log" not in fault)
