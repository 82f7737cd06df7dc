"""A worker whose queue anybody writes to: it does the orders that are signed, and drops and counts the rest."""

from __future__ import annotations

import base64
import json
import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from redis import Redis

from lippmann.job.messages import wire
from lippmann.job.messages.events import EventKind, Presence
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.messages.seals import Refused, Seals
from service.order_queue import OrderQueue
from tests.broker import Broker
from tests.builders_messages import SEALS, seals_in
from tests.farm import LIPPMANN
from tests.repository import ROOT
from tests.waiting import ENOUGH_S, until

PASSWORD = "a/b@c:d?e"
(RIGHTS,) = re.findall(r"^user lippmann-worker on #\w+ (.*)$", (ROOT / "deploy/broker-users.acl").read_text(), re.M)
QUEUE = wire.CARRIER_PREFIX + wire.QUEUE
CHANGES: tuple[dict[str, Any], ...] = (
    {"task": "celery.map"},
    {"task": "os.system"},
    {"task": "lippmann.render"},
    {"task": None},
    {"id": "other"},
    {"kwargs": {"order": []}},
    {"kwargs": {}},
)
"""What is changed in the message of a signed order."""


def order(attempt: str) -> Order:
    return Order(kind=TaskKind.ENCODE, job_id="j", task_id="j-0", attempt=attempt, attempt_number=1, output="none")


def publish(broker: Broker, seals: Seals, what: Order) -> None:
    queue = OrderQueue(broker.url, seals=seals, timeout_s=ENOUGH_S)
    queue.publish([what])
    queue.close()


@pytest.mark.promise(
    "Between processes",
    "A worker does only orders that are signed with a key of the farm; it drops and counts the rest and goes on.",
)
def test_a_worker_drops_and_counts_what_is_no_signed_order_and_goes_on(tmp_path: Path) -> None:
    broker, seals = Broker(tmp_path), seals_in(tmp_path)
    redis: Redis = broker.client
    redis.execute_command("ACL", "SETUSER", "lippmann-worker", "on", f">{PASSWORD}", *RIGHTS.split())  # type: ignore[no-untyped-call]
    password_file = tmp_path / "password"
    password_file.touch(0o600)
    password_file.write_text(PASSWORD + "\n")
    env = {
        **os.environ,
        "LIPPMANN_REDIS_URL": broker.url.replace("redis://", "redis://lippmann-worker@"),
        "LIPPMANN_REDIS_PASSWORD_FILE": str(password_file),
        "LIPPMANN_DATA_DIR": str(tmp_path),
        "LIPPMANN_WORKER_NAME": "w1",
    }
    log = (tmp_path / "log").open("wb")
    worker = subprocess.Popen([LIPPMANN, "worker", "--slots", "1"], env=env, stdout=log, stderr=subprocess.STDOUT)

    def presence() -> Presence | None:
        key = wire.presence_key("w1")
        try:
            text: Any = redis.get(key)
            return seals.open_presence(text, key=key.encode()) if text else None
        except Refused as error:
            raise AssertionError("the presence is not signed") from error

    try:
        publish(broker, seals, order("signed"))
        template: Any = redis.lpop(QUEUE)
        publish(broker, SEALS, order("of-another-farm"))
        unsigned = order("unsigned").model_dump(mode="json")
        poison = [
            b"nonsense", b"[]", b"{}", b"7", b"\xff", b"[" * 50_000,
            *(_changed(template, **change) for change in CHANGES),
            _changed(template, kwargs={"order": unsigned}),
        ]  # fmt: skip
        redis.lpush(QUEUE, *poison)
        publish(broker, seals, order("last"))
        until(lambda: (seen := presence()) is not None and seen.refused_orders == len(poison) + 1)
        done = until(lambda: [event for event in events(redis, seals) if event.kind is EventKind.FAILED])
        assert [event.attempt for event in done] == ["last"], "only the signed order was attempted"
        assert {event.attempt for event in events(redis, seals)} == {"last"}
        assert worker.poll() is None
        assert redis.acl_log() == [], "the user of the workers lacks a right"
        assert PASSWORD not in (tmp_path / "log").read_text()
        assert PASSWORD.encode() not in Path(f"/proc/{worker.pid}/cmdline").read_bytes()
    finally:
        log.close()
        worker.terminate()
        worker.wait(ENOUGH_S)
        redis.close()
        broker.kill()


def events(redis: Any, seals: Any) -> list[Any]:
    return [seals.open_event(fields[b"event"]) for _, fields in redis.xrange(wire.EVENTS_STREAM)]


def _changed(message: bytes, *, kwargs: dict[str, Any] | None = None, **headers: Any) -> bytes:
    """Return a message of Celery with other headers, or with other arguments."""
    changed = json.loads(message)
    changed["headers"] |= headers
    if kwargs is not None:
        changed["body"] = base64.b64encode(json.dumps([[], kwargs, {}]).encode()).decode()
    return json.dumps(changed).encode()
