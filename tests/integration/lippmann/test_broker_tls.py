"""A broker behind TLS: service, worker and doctor accept it with the certificates of its authority, and only then."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from lippmann.job.messages import wire
from service.broker_stream import Stream
from service.db.engine import Database
from service.db.migrations import migrate
from service.errors import BrokerUnavailable
from service.order_queue import OrderQueue
from service.settings import Settings
from tests.authority import Authority
from tests.broker import Broker
from tests.builders_messages import put_presence, seals_in
from tests.builders_service import presence
from tests.farm import LIPPMANN
from tests.integration.lippmann.conftest import run
from tests.integration.lippmann.test_refusals import QUEUE, order
from tests.tcp_proxy import tcp_proxy
from tests.waiting import ENOUGH_S, until

INVALID = "CERTIFICATE_VERIFY_FAILED"


@dataclass(frozen=True)
class TlsBroker:
    """A broker, and the ways to it."""

    broker: Broker
    folder: Path
    url: str
    """The URL whose host is in the certificate."""
    other_url: str
    """The URL of the same broker by another name."""
    ca_file: Path
    other_ca_file: Path

    def settings(self, **changes: Any) -> Settings:
        given: dict[str, Any] = {
            "redis_url": self.url,
            "redis_ca_file": self.ca_file,
            "data_dir": self.folder,
        } | changes
        return Settings(**given)

    def environment(self, **changes: str) -> dict[str, str]:
        return {
            "LIPPMANN_REDIS_URL": self.url,
            "LIPPMANN_REDIS_CA_FILE": str(self.ca_file),
            "LIPPMANN_DATA_DIR": str(self.folder),
            "LIPPMANN_WORKER_NAME": "w1",
            **changes,
        }


@pytest.fixture(scope="module")
def tls(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TlsBroker]:
    folder = tmp_path_factory.mktemp("tls")
    authority, broker = Authority(folder), Broker(folder, keeps_data=True)
    seals_in(folder)
    context = authority.server_context("127.0.0.1")
    with tcp_proxy(("127.0.0.1", broker.port), tls=context) as proxy:
        assert isinstance(proxy.address, tuple)
        port = proxy.address[1]
        yield TlsBroker(
            broker, folder, f"rediss://127.0.0.1:{port}/0", f"rediss://localhost:{port}/0", authority.ca_file,
            Authority(folder, "other").ca_file,
        )  # fmt: skip
    broker.kill()


@contextmanager
def stream_of(settings: Settings) -> Iterator[Stream]:
    stream = Stream(settings.broker, seals=settings.seals, timeout_s=ENOUGH_S)
    try:
        yield stream
    finally:
        stream.close()


def test_a_service_sends_orders_and_hears_workers_over_tls(tls: TlsBroker) -> None:
    settings = tls.settings()
    put_presence(tls.broker.client, presence(), settings.seals, ex=60)
    queue = OrderQueue(settings.broker, seals=settings.seals, timeout_s=ENOUGH_S)
    queue.publish([order("one")])
    queue.close()
    with stream_of(settings) as stream:
        assert [worker.name for worker in stream.presences()] == ["w1"]
        assert b'"one"' in (stream.first_order() or b"")
    tls.broker.client.flushall()


@pytest.mark.promise(
    "Between processes", "A broker whose certificate is of another authority, or for another host, is refused."
)
@pytest.mark.parametrize("wrong", ["authority", "host", "the certificates of the system"])
def test_a_broker_with_another_certificate_is_refused(tls: TlsBroker, wrong: str) -> None:
    changes: dict[str, dict[str, Any]] = {
        "authority": {"redis_ca_file": tls.other_ca_file},
        "host": {"redis_url": tls.other_url},
        "the certificates of the system": {"redis_ca_file": None},
    }
    settings = tls.settings(**changes[wrong])
    with stream_of(settings) as stream, pytest.raises(BrokerUnavailable, match=INVALID) as refused:
        stream.ping()
    assert "\n" not in str(refused.value)
    queue = OrderQueue(settings.broker, seals=settings.seals, timeout_s=5.0)
    with pytest.raises(BrokerUnavailable, match=INVALID):
        queue.publish([order("never")])
    queue.close()
    assert tls.broker.client.llen(QUEUE) == 0


@pytest.mark.promise(
    "Between processes", "A broker whose certificate is of another authority, or for another host, is refused."
)
def test_a_worker_takes_orders_over_tls_and_from_no_other_broker(tls: TlsBroker) -> None:
    with (tls.folder / "log").open("w+") as log:

        def start(**changes: str) -> subprocess.Popen[bytes]:
            env = {**os.environ, **tls.environment(**changes)}
            return subprocess.Popen([LIPPMANN, "worker", "--slots", "1"], env=env, stdout=log, stderr=log)

        def logged() -> str:
            return (tls.folder / "log").read_text()

        redis = tls.broker.client
        wrong, right = start(LIPPMANN_REDIS_CA_FILE=str(tls.other_ca_file), LIPPMANN_WORKER_NAME="wrong"), start()
        try:
            until(lambda: redis.exists(wire.presence_key("w1")))
            until(lambda: "certificate verify failed" in logged())
            assert not redis.exists(wire.presence_key("wrong"))
            assert "Traceback" not in logged()
        finally:
            for worker in (wrong, right):
                worker.terminate()
            for worker in (wrong, right):
                worker.wait(ENOUGH_S)


def test_the_doctor_says_what_is_wrong_with_the_broker_in_one_line(tls: TlsBroker, tmp_path: Path) -> None:
    (tmp_path / "artifacts").mkdir()
    database = Database(f"sqlite:///{tmp_path}/lippmann.db")
    migrate(database)
    database.dispose()
    checked = {
        name: run("doctor", "--data-dir", str(tmp_path), **tls.environment(**changes))
        for name, changes in {
            "right": {},
            "wrong": {"LIPPMANN_REDIS_CA_FILE": str(tls.other_ca_file)},
        }.items()
    }
    assert "broker" not in checked["right"].stdout
    assert checked["wrong"].returncode == 1, checked["wrong"]
    (line,) = (line for line in checked["wrong"].stdout.splitlines() if "broker" in line)
    assert line.startswith("error: broker: ")
    assert INVALID in line
