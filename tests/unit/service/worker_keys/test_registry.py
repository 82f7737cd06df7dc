"""The registry of worker keys does not ask a silent database for each message."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NoReturn

import pytest
from sqlalchemy.exc import OperationalError

from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.messages.seals import Unverifiable
from service.broker_stream import Stream
from service.errors import DatabaseUnavailable
from service.worker_keys.registry import KNOWN_S, WorkerKeys
from tests.builders_messages import SEALS
from tests.builders_service import heartbeat


def test_a_silent_database_is_asked_once_a_second_and_not_for_each_message() -> None:
    steady, asked = [0.0], []

    class Silent:
        def reading(self) -> NoReturn:
            asked.append(steady[0])
            steady[0] += 5.0
            raise OperationalError("", {}, Exception("timeout"))

    silent: Any = Silent()
    registry = WorkerKeys(silent, steady=lambda: steady[0])
    for _ in range(50):
        with pytest.raises(Unverifiable, match="the database does not answer"):
            registry.message_key("0" * 12)
        steady[0] += 0.01
    assert asked == [0.0]
    steady[0] += KNOWN_S
    with pytest.raises(Unverifiable):
        registry.message_key("0" * 12)
    assert len(asked) == 2


def test_an_event_whose_key_cannot_be_found_now_is_read_again_and_not_dropped() -> None:
    def find(key_id: str | None) -> bytes:
        raise Unverifiable("the database does not answer")

    stream = Stream("redis://127.0.0.1:1/0", seals=replace(SEALS, find_worker_key=find), timeout_s=0.1)
    order = Order(kind=TaskKind.PROBE, job_id="j", task_id="j-0", attempt="a", attempt_number=1)
    with pytest.raises(DatabaseUnavailable):
        stream._event({b"event": SEALS.sealed_event(heartbeat(order)).encode()})
    assert not stream.dropped
    stream.close()
