"""A farm is upgraded one host after the other: each side understands the messages of the other's version."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import BaseModel

from lippmann.job.messages.events import Event, EventKind, Failure, Lease, Presence, ProbeResult
from tests.builders_service import PROBE, presence

FAILURE = Failure(code="lost", message="m", permanent=False)
EVENT = Event(
    kind=EventKind.FAILED, job_id="j", task_id="j-1", attempt="a", worker="w1", at_s=1.0, failure=FAILURE, probe=PROBE
)
LEASE = Lease(worker="w1", instance="i", at_s=1.0)


@pytest.mark.parametrize("message", [EVENT, FAILURE, PROBE, LEASE, presence()])
def test_the_fields_of_a_newer_worker_are_ignored(message: BaseModel) -> None:
    newer = message.model_dump() | {"colour": "red"}
    assert type(message).model_validate(newer) == message


@pytest.mark.parametrize("field", ["failure", "probe"])
def test_the_fields_of_what_is_inside_an_event_are_ignored_too(field: str) -> None:
    newer: dict[str, Any] = EVENT.model_dump()
    newer[field]["colour"] = "red"
    assert Event.model_validate(newer) == EVENT


def test_an_older_worker_says_neither_its_instance_nor_what_it_holds() -> None:
    event = Event.model_validate({name: value for name, value in EVENT.model_dump().items() if name != "instance"})
    older = {name: value for name, value in presence().model_dump().items() if name not in ("instance", "holds")}
    assert (event.instance, Presence.model_validate(older).instance, Presence.model_validate(older).holds) == (
        None,
    ) * 3
    assert ProbeResult.model_validate({"start_s": 0.5, "s_per_px": 1e-5, "tileable": True}).renders
