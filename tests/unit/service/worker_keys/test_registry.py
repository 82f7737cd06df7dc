"""The registry of worker keys does not ask a silent database for each message."""

from __future__ import annotations

from typing import Any, NoReturn

import pytest
from sqlalchemy.exc import OperationalError

from lippmann.job.messages.seals import KeyRefused, Refused
from service.worker_keys.registry import KNOWN_S, WorkerKeys


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
        with pytest.raises(Refused, match="the database does not answer") as refused:
            registry.message_key("0" * 12)
        assert not isinstance(refused.value, KeyRefused)
        steady[0] += 0.01
    assert asked == [0.0]
    steady[0] += KNOWN_S
    with pytest.raises(Refused):
        registry.message_key("0" * 12)
    assert len(asked) == 2
