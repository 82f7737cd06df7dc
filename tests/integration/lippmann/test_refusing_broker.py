"""A worker outlives a broker that answers and refuses: it takes orders again when the broker does as it is asked."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
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


@contextmanager
def running_worker(broker: Broker, folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """Run a worker with its log and its heartbeat file in a folder, and wait until it is online."""
    env = {
        **os.environ,
        "LIPPMANN_REDIS_URL": broker.url,
        "LIPPMANN_DATA_DIR": str(folder),
        "LIPPMANN_HEARTBEAT_FILE": str(folder / "heartbeat"),
    }
    with (folder / "log").open("wb") as file:
        worker = subprocess.Popen([LIPPMANN, "worker", "--slots", "1"], env=env, stdout=file, stderr=subprocess.STDOUT)
    try:
        until(lambda: broker.client.keys(wire.presence_key("*")))
        yield worker
    finally:
        worker.terminate()
        worker.wait(ENOUGH_S)
        broker.kill()


@pytest.mark.parametrize("words", REFUSALS)
def test_a_worker_outlives_a_broker_that_refuses(tmp_path: Path, words: str) -> None:
    broker, seals = Broker(tmp_path), seals_in(tmp_path)
    begin, end = REFUSALS[words]
    with running_worker(broker, tmp_path) as worker:
        broker.client.execute_command(*begin.split())
        until(lambda: words in (tmp_path / "log").read_text() or worker.poll() is not None)
        broker.client.execute_command(*end.split())
        publish(broker, seals, order("later"))
        failed = until(lambda: [event for event in events(broker.client, seals) if event.kind is EventKind.FAILED])
        assert [event.attempt for event in failed] == ["later"]
        assert worker.poll() is None


@pytest.mark.parametrize(
    ("words", "begin"),
    [("read only replica", "REPLICAOF 127.0.0.1 1"), ("used memory > 'maxmemory'", "CONFIG SET maxmemory 1")],
)
def test_a_worker_gives_signs_of_life_and_is_drained_while_the_broker_answers_and_refuses(
    tmp_path: Path, words: str, begin: str
) -> None:
    broker = Broker(tmp_path)
    seals_in(tmp_path)
    heartbeat_file = tmp_path / "heartbeat"
    with running_worker(broker, tmp_path) as worker:
        broker.client.execute_command(*begin.split())
        broker.client.execute_command("CLIENT", "KILL", "TYPE", "normal")  # A poll of a full broker is not refused.
        until(lambda: (tmp_path / "log").read_text().count(words) > 1 or worker.poll() is not None)
        heartbeat_file.unlink()
        until(lambda: heartbeat_file.exists() or worker.poll() is not None)
        assert worker.poll() is None
        worker.send_signal(signal.SIGUSR1)
        assert worker.wait(ENOUGH_S) == 0
