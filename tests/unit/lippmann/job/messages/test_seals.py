"""Messages are signed, and what is not signed by a known key is refused."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lippmann.digest import Digest
from lippmann.job.messages import wire
from lippmann.job.messages.events import (
    MAX_EVENT_BYTES,
    MAX_LEASE_BYTES,
    MAX_MESSAGE_VALUES,
    MAX_PRESENCE_BYTES,
    MAX_SLOTS,
    Event,
    EventKind,
    Lease,
    NotClaiming,
    Presence,
)
from lippmann.job.messages.orders import Order, TaskKind, TileIndex
from lippmann.job.messages.seals import (
    CLOCK_DRIFT_S,
    ORDER_TTL_S,
    NoKey,
    Purpose,
    Refused,
    Seals,
    canonical,
)
from tests.builders_messages import SEALS
from tests.builders_service import presence

NOW_S = 1.8e9
OTHER = Seals(lambda: (b"another key of thirty-two bytes.",))
UNSIGNED = replace(SEALS, accept_unsigned=True)
ORDER = Order(
    kind=TaskKind.RENDER, job_id="j", task_id="j-1", attempt="a", attempt_number=1, frame=3,
    tile=TileIndex(row=0, col=1), avoid=("wörker",), digests={"x.exr": Digest(1, "0" * 64)},
)  # fmt: skip
EVENT = Event(kind=EventKind.DONE, job_id="j", task_id="j-1", attempt="a", worker="w1", at_s=1.5, cpu_s=2,
              digests={"x.exr": Digest(1, "0" * 64)})  # fmt: skip
LEASE = Lease(attempt="a", worker="w1", instance="i1", at_s=1.5)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


def opened(message: object, seals: Seals = SEALS, *, kind: TaskKind = TaskKind.RENDER, attempt: str = "a",
           now_s: float = NOW_S) -> Order:  # fmt: skip
    return seals.open_order(message, kind=kind, attempt=attempt, now_s=now_s)


def sealed() -> dict[str, Any]:
    """Return the order as Celery carries it."""
    message: dict[str, Any] = json.loads(json.dumps(SEALS.sealed_order(ORDER, now_s=NOW_S)))
    return message


@settings(max_examples=30)
@given(st.dictionaries(st.text(), JSON))
def test_the_canonical_form_is_the_same_after_a_journey(fields: dict[str, Any]) -> None:
    travelled = json.loads(json.dumps(dict(reversed(fields.items())), indent=1))
    assert canonical(travelled) == canonical(fields)


def test_sealed_messages_open_as_they_were() -> None:
    assert opened(sealed()) == ORDER
    assert SEALS.open_event(SEALS.sealed_event(EVENT).encode()) == EVENT
    text = SEALS.sealed_presence(presence("w1")).encode()
    assert SEALS.open_presence(text, key=wire.presence_key("w1").encode()) == presence("w1")
    assert SEALS.open_lease(SEALS.sealed_lease(LEASE).encode(), attempt="a") == LEASE
    SEALS.check_stop(SEALS.sealed_stop("a").encode(), attempt="a")
    found = NotClaiming(since_s={"w1": 2.0})
    assert SEALS.open_not_claiming(SEALS.sealed_not_claiming(found).encode()) == found


def test_a_version_without_seals_reads_sealed_messages() -> None:
    assert Order.model_validate(sealed()) == ORDER
    assert Event.model_validate_json(SEALS.sealed_event(EVENT)) == EVENT
    assert Presence.model_validate_json(SEALS.sealed_presence(presence())) == presence()
    assert Lease.model_validate_json(SEALS.sealed_lease(LEASE)) == LEASE


def test_every_key_of_the_file_is_accepted_and_the_first_one_signs() -> None:
    old, new = SEALS.keys()[0], b"n" * 32
    both = Seals(lambda: (new, old))
    assert opened(sealed(), both) == ORDER
    assert opened(both.sealed_order(ORDER, now_s=NOW_S), Seals(lambda: (new,))) == ORDER


@pytest.mark.promise(
    "Between processes", "An order that was changed, is stale, or lies in the envelope of another is refused."
)
@pytest.mark.parametrize(
    "change",
    [
        lambda message: message.pop("seal"),
        lambda message: message.update(seal=""),
        lambda message: message.update(seal=7),
        lambda message: message.update(seal="é"),
        lambda message: message.update(frame=4),
        lambda message: message.update(sealed_s=NOW_S + 1),
        lambda message: message.update(added=1),
        lambda message: message.pop("avoid"),
        lambda message: message.update(seal=OTHER.sealed_order(ORDER, now_s=NOW_S)["seal"]),
        lambda message: message.update(json.loads(SEALS.sealed_event(EVENT)), kind="render"),
    ],
)
def test_an_order_that_is_not_as_it_was_signed_is_refused(change: Callable[[dict[str, Any]], object]) -> None:
    message = sealed()
    change(message)
    with pytest.raises(Refused):
        opened(message)


@pytest.mark.parametrize("age_s", [ORDER_TTL_S + 1, -CLOCK_DRIFT_S - 1])
def test_a_stale_order_is_refused(age_s: float) -> None:
    with pytest.raises(Refused, match="stale"):
        opened(sealed(), now_s=NOW_S + age_s)


def test_an_order_in_the_envelope_of_another_is_refused() -> None:
    for envelope in ({"kind": TaskKind.ENCODE}, {"attempt": "b"}):
        with pytest.raises(Refused, match="envelope"):
            opened(sealed(), **envelope)


def test_a_seal_for_one_purpose_is_none_for_another() -> None:
    fields = {"at_s": 1.0}
    seals = {SEALS._sealed(purpose, fields)["seal"] for purpose in get_args(Purpose)}
    assert len(seals) == 9


@pytest.mark.parametrize("message", [None, 7, "x", [], [["a"] * 3], {}])
def test_what_is_no_order_is_refused(message: object) -> None:
    with pytest.raises(Refused):
        opened(message)


@pytest.mark.parametrize(
    "text",
    [
        b"",
        b"nonsense",
        b"\xff\xfe",
        b"[" * 100_000,
        b"1" * 5000,
        b"null",
        b'{"kind": "done"}',
        b"x" * (MAX_EVENT_BYTES + 1),
    ],
    ids=lambda text: f"{text[:9]!r} of {len(text)}",
)
def test_what_is_no_event_is_refused_at_once(text: bytes) -> None:
    for seals in (SEALS, UNSIGNED):
        with pytest.raises(Refused):
            seals.open_event(text)


def test_a_message_of_very_many_values_is_refused_before_it_is_parsed() -> None:
    text = b"[" + b"0," * MAX_MESSAGE_VALUES + b"0]"
    with pytest.raises(Refused, match=f"about {MAX_MESSAGE_VALUES + 1} values"):
        SEALS.open_event(text)


def test_the_digests_of_a_hundred_thousand_files_are_one_event() -> None:
    digest = Digest(1, "0" * 64)
    event = EVENT.model_copy(update={"digests": {f"view/{number}.png": digest for number in range(100_000)}})
    assert SEALS.open_event(SEALS.sealed_event(event).encode()) == event


@pytest.mark.parametrize("change", [{"worker": "a\nb"}, {"worker": ""}, {"worker": "w" * 101}, {"attempt": "a" * 501}])
def test_an_event_with_an_impossible_name_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(Refused, match="invalid"):
        SEALS.open_event(SEALS.sealed_event(EVENT.model_copy(update=change)).encode())


@pytest.mark.parametrize(
    "change",
    [
        {"name": "w2"},
        {"slots": -1},
        {"slots": MAX_SLOTS + 1},
        {"holds": ("a",) * MAX_PRESENCE_BYTES},
        {"host": "h" * 501},
    ],
)
def test_a_presence_is_bounded_and_of_the_worker_whose_key_it_has(change: dict[str, Any]) -> None:
    text = SEALS.sealed_presence(presence("w1").model_copy(update=change)).encode()
    with pytest.raises(Refused):
        SEALS.open_presence(text, key=wire.presence_key("w1").encode())


def test_the_largest_honest_presence_is_accepted() -> None:
    most = presence("w1", slots=1024).model_copy(update={"holds": tuple(f"{i:032x}" for i in range(2048))})
    text = SEALS.sealed_presence(most).encode()
    assert len(text) < MAX_PRESENCE_BYTES
    assert SEALS.open_presence(text, key=wire.presence_key("w1").encode()) == most


@pytest.mark.parametrize(
    "text",
    [
        b"1",
        b"",
        b"null",
        LEASE.model_dump_json().encode(),
        b'{"attempt": "a"}',
        OTHER.sealed_lease(LEASE).encode(),
        OTHER.sealed_stop("a").encode(),
        SEALS.sealed_event(EVENT).encode(),
        SEALS.sealed_lease(LEASE.model_copy(update={"attempt": "b"})).encode(),
        SEALS.sealed_stop("b").encode(),
        b"[" * (MAX_LEASE_BYTES + 1),
    ],
)
def test_a_lease_or_a_stop_signal_of_a_stranger_or_another_attempt_is_refused(text: bytes) -> None:
    for open_text in (SEALS.open_lease, SEALS.check_stop):
        with pytest.raises(Refused):
            open_text(text, attempt="a")


def test_a_lease_is_no_stop_signal_and_the_other_way_round() -> None:
    with pytest.raises(Refused, match="wrong signature"):
        SEALS.check_stop(SEALS.sealed_lease(LEASE).encode(), attempt="a")
    with pytest.raises(Refused, match="wrong signature"):
        SEALS.open_lease(SEALS.sealed_stop("a").encode(), attempt="a")


def test_while_the_farm_is_upgraded_leases_and_stop_signals_of_earlier_versions_count() -> None:
    UNSIGNED.check_stop(b"1", attempt="a")
    assert UNSIGNED.open_lease(b'{"worker": "w1", "at_s": 1.5}', attempt="a") == Lease(worker="w1", at_s=1.5)
    with pytest.raises(Refused):
        UNSIGNED.check_stop(OTHER.sealed_stop("a").encode(), attempt="a")


def test_unsigned_messages_are_accepted_only_while_the_farm_is_upgraded_and_wrong_seals_never() -> None:
    unsigned = ORDER.model_dump(mode="json")
    assert opened(unsigned, UNSIGNED) == ORDER
    with pytest.raises(Refused):
        opened(unsigned | {"seal": "0" * 64}, UNSIGNED)


def test_nothing_is_signed_without_a_key() -> None:
    with pytest.raises(NoKey):
        Seals(tuple).sealed_event(EVENT)
