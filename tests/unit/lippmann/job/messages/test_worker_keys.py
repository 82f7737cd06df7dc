"""Workers with a key of their own sign with it too, and nobody else's messages are taken for theirs."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lippmann.job.messages import wire
from lippmann.job.messages.events import Event, EventKind, Lease, Presence
from lippmann.job.messages.seals import KeyRefused, Refused, Seals
from lippmann.job.messages.worker_keys import KEY_REFUSED, WorkerKey, key_of_instance
from tests.builders_messages import SEALS
from tests.builders_service import presence

ONE, TWO = (WorkerKey.of_secret(letter * 12, f"the secret of {letter}") for letter in "ab")
VALID = {ONE.id: ONE.message_key, TWO.id: TWO.message_key}


def find(key_id: str | None) -> bytes:
    """Return what verifies a key, as a service does."""
    if key_id is None:
        return b""
    if key_id not in VALID:
        raise KeyRefused(f"its worker key {key_id} was revoked")
    return VALID[key_id]


SERVICE = replace(SEALS, find_worker_key=find)


def seals_of(key: WorkerKey | None) -> Seals:
    return replace(SEALS, worker_key=key)


def event(instance: str | None) -> Event:
    return Event(kind=EventKind.DONE, job_id="j", task_id="j-1", attempt="a", worker="w1", instance=instance, at_s=1.5)


def lease(instance: str | None) -> Lease:
    return Lease(attempt="a", worker="w1", instance=instance, at_s=1.5)


def present(instance: str | None, key: WorkerKey | None) -> Presence:
    holding = {"holds": ("a",), "instance": instance, "worker_key": None if key is None else key.id}
    return presence("w1", slots=4).model_copy(update=holding)


@pytest.mark.parametrize("key", [ONE, None])
def test_the_messages_of_a_worker_are_accepted_with_and_without_a_key(key: WorkerKey | None) -> None:
    instance = "f00d" if key is None else key.instance("f00d")
    seals, redis_key = seals_of(key), wire.presence_key("w1").encode()
    assert SERVICE.open_event(seals.sealed_event(event(instance)).encode()) == event(instance)
    assert SERVICE.open_lease(seals.sealed_lease(lease(instance)).encode(), attempt="a") == lease(instance)
    found = SERVICE.open_presence(seals.sealed_presence(present(instance, key)).encode(), key=redis_key)
    assert found == present(instance, key)


def test_a_service_without_worker_keys_accepts_the_messages_of_a_worker_with_one() -> None:
    instance = ONE.instance("f00d")
    assert SEALS.open_event(seals_of(ONE).sealed_event(event(instance)).encode()) == event(instance)


@pytest.mark.promise("Between processes", "No worker speaks for a worker with another key.")
@pytest.mark.parametrize(
    ("key", "instance"),
    [
        (TWO, ONE.instance("f00d")),
        (None, ONE.instance("f00d")),
        (WorkerKey(ONE.id, TWO.digest), ONE.instance("f00d")),
        (ONE, "f00d"),
        (ONE, None),
    ],
)
def test_a_message_that_is_not_signed_with_the_key_of_its_worker_is_refused(
    key: WorkerKey | None, instance: str | None
) -> None:
    seals = seals_of(key)
    with pytest.raises(Refused):
        SERVICE.open_event(seals.sealed_event(event(instance)).encode())
    with pytest.raises(Refused):
        SERVICE.open_lease(seals.sealed_lease(lease(instance)).encode(), attempt="a")
    with pytest.raises(Refused):
        SERVICE.open_presence(
            seals.sealed_presence(present(instance, key)).encode(), key=wire.presence_key("w1").encode()
        )


def test_a_worker_with_a_revoked_key_is_present_with_this_fault_and_reports_nothing() -> None:
    gone = WorkerKey.of_secret("c" * 12, "the secret of c")
    seals, instance = seals_of(gone), gone.instance("f00d")
    with pytest.raises(KeyRefused, match="was revoked"):
        SERVICE.open_event(seals.sealed_event(event(instance)).encode())
    with pytest.raises(KeyRefused):
        SERVICE.open_lease(seals.sealed_lease(lease(instance)).encode(), attempt="a")
    text = seals.sealed_presence(present(instance, gone)).encode()
    found = SERVICE.open_presence(text, key=wire.presence_key("w1").encode())
    assert found.fault is not None
    assert (found.fault.code, found.fault.message) == (KEY_REFUSED, "its worker key cccccccccccc was revoked")
    assert (found.slots, found.holds, found.worker_key) == (0, (), gone.id)


def test_what_is_derived_from_a_secret_differs_by_purpose_and_by_key() -> None:
    keys = [ONE, TWO]
    derived = {key.message_key.hex() for key in keys} | {key.broker_password for key in keys}
    assert len(derived | {key.digest.hex() for key in keys}) == 6
    assert key_of_instance(ONE.instance("f00d")) == ONE.id
