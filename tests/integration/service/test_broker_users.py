"""The users of the broker: each does its work, and nothing else."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

import pytest
from redis import Redis
from redis.exceptions import AuthenticationError, NoPermissionError

from lippmann.job.messages import wire
from lippmann.job.messages.previews import PreviewOrder
from lippmann.key_file import KeyFile, read_secret
from service.previews.broker import PreviewBroker
from tests.broker import Broker, broker_with_users
from tests.builders_messages import SEALS
from tests.builders_service import SPEC, claimed
from tests.integration.service.conftest import ORDERS, FakeWorker, Service, at_once
from tests.preview_worker import Answering
from tests.repository import ROOT
from tests.unit.service.previews.test_choose import job
from tests.waiting import ENOUGH_S, until

USERS = dict(re.findall(r"^user (lippmann-\w+) on #\w+ (.*)$", (ROOT / "deploy/broker-users.acl").read_text(), re.M))
PASSWORD = "a/b@c"
OTHERS = "lippmann:not-claiming"
"""A key of the service that is none of the workers'."""


def as_user(broker: Broker, user: str) -> Redis:
    admin: Any = broker.client
    admin.execute_command("ACL", "SETUSER", user, "reset", "on", f">{PASSWORD}", *USERS[user].split())
    return Redis(port=broker.port, username=user, password=PASSWORD, socket_timeout=ENOUGH_S)


def test_a_service_does_all_its_work_as_its_user(
    broker: Broker, tmp_path: Path, make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker]
) -> None:
    as_user(broker, "lippmann-service").close()
    password_file = tmp_path / "password"
    password_file.touch(0o600)
    password_file.write_text(PASSWORD)
    url = broker.url.replace("redis://", "redis://lippmann-service@")
    service = make_service(redis_url=url, redis_password_file=password_file)
    held: list[str] = []
    make_worker(lambda order: [claimed(order)] if order.job_id in held else at_once(order))
    job_id = service.client.post("/jobs", json=SPEC).json()["id"]
    until(lambda: service.status(job_id) == "done")
    held.append(service.client.post("/jobs", json=SPEC).json()["id"])
    until(lambda: service.client.get(f"/jobs/{held[0]}").json()["tasks"]["running"])
    service.client.post(f"/jobs/{held[0]}/cancel")
    until(lambda: broker.client.keys(wire.stop_key("*")))
    assert service.client.get("/health").json()["broker"]["ok"]
    assert len(service.client.get("/workers").json()["items"]) == 1
    service.stop()
    # It asks once whether it may make users for the keys of workers.
    assert [entry["object"] for entry in broker.client.acl_log() if entry["object"] != "acl|users"] == []


REFUSED: tuple[tuple[str, ...], ...] = (
    ("FLUSHALL",), ("KEYS", "*"), ("SCAN", "0"), ("CONFIG", "GET", "*"), ("SHUTDOWN",), ("ACL", "LIST"), ("MONITOR",),
    ("EVAL", "return 1", "0"), ("GET", OTHERS), ("SET", OTHERS, "{}"), ("DEL", wire.MARKER), ("GET", "other"),
    ("LPUSH", ORDERS, "x"), ("XREAD", "STREAMS", wire.EVENTS_STREAM, "0"), ("XRANGE", wire.EVENTS_STREAM, "-", "+"),
    ("XTRIM", wire.EVENTS_STREAM, "MAXLEN", "0"), ("RENAME", ORDERS, "x"), ("MIGRATE", "h", "1", "k", "0", "1"),
    ("REPLICAOF", "NO", "ONE"), ("PUBLISH", "c", "m"), ("CLIENT", "KILL", "TYPE", "normal"),
)  # fmt: skip
"""What a worker has no need of."""


@pytest.mark.promise("Between processes", "A worker's user at the broker does what a worker needs, and nothing else.")
def test_a_worker_does_nothing_at_the_broker_that_is_not_its_work(broker: Broker) -> None:
    worker: Any = as_user(broker, "lippmann-worker")
    for command in REFUSED:
        with pytest.raises(NoPermissionError):
            worker.execute_command(*command)
    worker.set(wire.lease_key("a"), "mine")  # which is its work
    worker.close()


def test_a_preview_takes_the_rights_that_the_two_users_have(broker: Broker) -> None:
    urls = [broker.url.replace("redis://", f"redis://{user}:{quote(PASSWORD, safe='')}@") for user in USERS]
    for user in USERS:
        as_user(broker, user).close()
    by_user = dict(zip(USERS, urls, strict=True))
    previews = PreviewBroker(by_user["lippmann-service"], seals=SEALS)
    order = PreviewOrder(id="0" * 32, worker="w1", job=job(), frame=1, timeout_s=9)
    with Answering(by_user["lippmann-worker"]):
        previews.send(order, series="s")
        until(lambda: previews.answer(order.id, worker="w1", wait_s=0.2))
    assert previews.is_newest(order.id, series="s")
    previews.drop(order.id)
    previews.close()
    assert broker.client.acl_log() == []


def test_a_service_does_nothing_at_the_broker_outside_of_the_farm(broker: Broker) -> None:
    service: Any = as_user(broker, "lippmann-service")
    for command in (*REFUSED[:2], *REFUSED[3:7], ("GET", "other"), ("SET", "other", "1"), ("CLIENT", "LIST")):
        with pytest.raises(NoPermissionError):
            service.execute_command(*command)
    service.close()


def test_the_script_makes_users_that_log_in_with_the_passwords_that_it_wrote(tmp_path: Path) -> None:
    folder = tmp_path / "secrets"

    def make() -> tuple[dict[str, str], bytes]:
        subprocess.run([ROOT / "deploy/secrets", folder, str(os.getuid())], check=True, capture_output=True)
        (orders,) = KeyFile(folder / "order.key").keys()
        return {name: read_secret(folder / f"broker-{name}.password") for name in ("service", "worker")}, orders

    passwords, orders = make()
    assert make() == (passwords, orders), "what exists is kept"
    assert {len(password) for password in passwords.values()} == {64}
    assert (folder / "broker-service.password").stat().st_mode & 0o777 == 0o600
    assert not any(password in (folder / "broker-users.acl").read_text() for password in passwords.values())
    with broker_with_users(folder / "broker-users.acl", tmp_path) as port:
        for name, password in passwords.items():
            with Redis(port=port, username=f"lippmann-{name}", password=password) as client:
                assert client.ping()
            with pytest.raises(AuthenticationError), Redis(port=port, username=f"lippmann-{name}", password="x") as no:
                no.ping()
        with pytest.raises(NoPermissionError), Redis(port=port, protocol=2) as anybody:
            anybody.get("lippmann:broker")
