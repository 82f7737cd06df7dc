"""A worker outlives a broker that answers and refuses: it takes orders again when the broker does as it is asked."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import pytest

from lippmann.job.messages import wire
from lippmann.job.messages.events import EventKind
from tests.broker import Broker
from tests.builders_messages import seals_in
from tests.farm import LIPPMANN
from tests.integration.lippmann.test_refusals import events, order, publish
from tests.waiting import ENOUGH_S, until

REFUSALS = {
    "Not enough good replicas": ("CONFIG SET min-replicas-to-write 1", "CONFIG SET min-replicas-to-write 0"),
    "read only replica": ("REPLICAOF 127.0.0.1 1", "REPLICAOF NO ONE"),
}
"""The words of a broker that refuses, what makes it refuse, and what ends it."""


@pytest.mark.parametrize("words", REFUSALS)
def test_a_worker_outlives_a_broker_that_refuses(tmp_path: Path, words: str) -> None:
    broker, seals = Broker(tmp_path), seals_in(tmp_path)
    env = {**os.environ, "LIPPMANN_REDIS_URL": broker.url, "LIPPMANN_DATA_DIR": str(tmp_path)}
    log = tmp_path / "log"
    with log.open("wb") as file:
        worker = subprocess.Popen([LIPPMANN, "worker", "--slots", "1"], env=env, stdout=file, stderr=subprocess.STDOUT)
    begin, end = REFUSALS[words]
    try:
        until(lambda: broker.client.keys(wire.presence_key("*")))
        broker.client.execute_command(*begin.split())
        until(lambda: words in log.read_text() or worker.poll() is not None)
        broker.client.execute_command(*end.split())
        publish(broker, seals, order("later"))
        failed = until(lambda: [event for event in events(broker.client, seals) if event.kind is EventKind.FAILED])
        assert [event.attempt for event in failed] == ["later"]
        assert worker.poll() is None
    finally:
        worker.terminate()
        worker.wait(ENOUGH_S)
        broker.kill()
