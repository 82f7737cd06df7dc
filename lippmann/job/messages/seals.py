"""Seals: every message between service and workers is encoded, signed, verified and decoded here, and nowhere else.

Whoever can write to the broker can write anything under the names of `lippmann.job.messages.wire`. A message therefore
carries a seal, the HMAC-SHA-256 of its canonical JSON, and without a valid one it is refused before it is decoded. The
seal is a field of the message, so that a version without seals ignores it.
"""

from __future__ import annotations

import hmac
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

from pydantic import BaseModel, ValidationError

from lippmann.job.messages import wire
from lippmann.job.messages.events import (
    MAX_EVENT_BYTES,
    MAX_LEASE_BYTES,
    MAX_MESSAGE_VALUES,
    MAX_PRESENCE_BYTES,
    Directions,
    Event,
    Lease,
    NotClaiming,
    Presence,
    PresenceFault,
    StopSignal,
)
from lippmann.job.messages.orders import Order, TaskKind
from lippmann.job.messages.previews import MAX_ANSWER_BYTES, MAX_ORDER_BYTES, PreviewAnswer, PreviewOrder
from lippmann.job.messages.worker_keys import (
    KEY_REFUSED,
    WORKER_KEY,
    WORKER_SEAL,
    FindWorkerKey,
    WorkerKey,
    key_of_instance,
)

SEAL = "seal"
SEALED_S = "sealed_s"
ORDER_TTL_S = 8 * 86_400.0
"""The age above which an order is refused, longer than the longest task that a waiting order waits for."""
CLOCK_DRIFT_S = 3600.0
"""The largest difference of the clocks of two hosts for which an order is not refused."""

Model = TypeVar("Model", bound=BaseModel)
UNSIGNED_STOP = b"1"
"""The stop signal of a version without seals."""

Purpose = Literal[
    "order", "event", "presence", "lease", "stop", "not-claiming", "directions", "preview-order", "preview-answer"
]
"""The kind of a message. It is signed too, so that no event is taken for an order."""


class Refused(ValueError):
    """The message is not accepted."""


class Unverifiable(Refused):
    """The message may be right, but its key cannot be found now."""


class KeyRefused(Refused):
    """The message is of a worker whose key is missing, unknown or revoked, or has expired."""


class NoKey(ValueError):
    """There is no key to sign messages with."""


@dataclass(frozen=True)
class Seals:
    """Signs and verifies messages.

    Parameters
    ----------
    keys
        Returns the keys, the signing one first, whenever a message is signed or verified.
    accept_unsigned
        True while hosts of a version without seals are on the farm. A wrong seal is refused all the same.
    worker_key
        The key of the worker that signs; None in the service, and in a worker that has none.
    find_worker_key
        What the service verifies the keys of workers with; None in a worker, which does not verify them.
    """

    keys: Callable[[], Sequence[bytes]]
    accept_unsigned: bool = False
    worker_key: WorkerKey | None = None
    find_worker_key: FindWorkerKey | None = None

    def sealed_order(self, order: Order, *, now_s: float) -> dict[str, Any]:
        """Return the message of an order.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return self._sealed("order", {**order.model_dump(mode="json"), SEALED_S: now_s})

    def open_order(self, message: object, *, kind: TaskKind, attempt: str, now_s: float) -> Order:
        """Return the order in a message.

        Parameters
        ----------
        kind, attempt
            What the envelope of the message says; it is not signed, so it must agree with the order.

        Raises
        ------
        Refused
            If the order is not signed, is stale, cannot be decoded, or does not belong to the envelope.
        """
        fields = self._verified("order", message)
        sealed_s = fields.get(SEALED_S)
        is_dated = isinstance(sealed_s, float | int) and now_s - ORDER_TTL_S <= sealed_s <= now_s + CLOCK_DRIFT_S
        if not is_dated and not (sealed_s is None and self.accept_unsigned):
            raise Refused(f"the order is stale: it was signed at {sealed_s} s, and now it is {now_s:.0f} s")
        order = _decoded(Order, fields)
        if (order.kind, order.attempt) != (kind, attempt):
            raise Refused(f"the order is for {order.kind} {order.attempt}, its envelope for {kind} {attempt}")
        return order

    def sealed_event(self, event: Event) -> str:
        """Return the message of an event.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return json.dumps(self._sealed("event", event.model_dump(mode="json", exclude_none=True)))

    def open_event(self, text: bytes) -> Event:
        """Return the event in a message.

        Raises
        ------
        Refused
            If it is not signed, is too large, or cannot be decoded.
        """
        fields = self._verified("event", _parsed(text, MAX_EVENT_BYTES))
        self._check_worker("event", fields)
        return _decoded(Event, fields)

    def sealed_presence(self, presence: Presence) -> str:
        """Return the message of a presence.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return json.dumps(self._sealed("presence", presence.model_dump(mode="json")))

    def open_presence(self, text: bytes, *, key: bytes) -> Presence:
        """Return the presence in the value of a key of the broker.

        A worker whose key is refused is present with this fault, without slots and without attempts.

        Raises
        ------
        Refused
            If it is not signed, is too large, cannot be decoded, or is of another worker than the key.
        """
        fields = self._verified("presence", _parsed(text, MAX_PRESENCE_BYTES))
        presence = _decoded(Presence, fields)
        if wire.presence_key(presence.name).encode() != key:
            raise Refused(f"the presence of {presence.name} has the key {key!r}")
        try:
            self._check_worker("presence", fields)
        except KeyRefused as error:
            fault = PresenceFault(code=KEY_REFUSED, message=str(error))
            return presence.model_copy(update={"slots": 0, "holds": (), "consuming_s": None, "fault": fault})
        return presence

    def sealed_lease(self, lease: Lease) -> str:
        """Return the text of a lease.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return json.dumps(self._sealed("lease", lease.model_dump(mode="json", exclude_none=True)))

    def open_lease(self, text: bytes, *, attempt: str) -> Lease:
        """Return the lease in the value of an attempt's key of the broker.

        Raises
        ------
        Refused
            If it is not signed, is too large, cannot be decoded, or is of another attempt.
        """
        fields = self._verified("lease", _parsed(text, MAX_LEASE_BYTES))
        self._check_worker("lease", fields)
        lease = _decoded(Lease, fields)
        if lease.attempt != attempt and not (lease.attempt is None and self.accept_unsigned):
            raise Refused(f"the lease of {lease.attempt} has the key of {attempt}")
        return lease

    def sealed_stop(self, attempt: str) -> str:
        """Return the stop signal of an attempt.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return json.dumps(self._sealed("stop", StopSignal(attempt=attempt).model_dump(mode="json")))

    def check_stop(self, text: bytes, *, attempt: str) -> None:
        """Accept the stop signal in the value of an attempt's key of the broker.

        Raises
        ------
        Refused
            If it is not signed, is too large, cannot be decoded, or is of another attempt.
        """
        if text == UNSIGNED_STOP and self.accept_unsigned:
            return
        signal = _decoded(StopSignal, self._verified("stop", _parsed(text, MAX_LEASE_BYTES)))
        if signal.attempt != attempt:
            raise Refused(f"the stop signal of {signal.attempt} has the key of {attempt}")

    def sealed_not_claiming(self, found: NotClaiming) -> str:
        """Return the text of the list of the workers that take no orders.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return json.dumps(self._sealed("not-claiming", found.model_dump(mode="json")))

    def open_not_claiming(self, text: bytes) -> NotClaiming:
        """Return the list of the workers that take no orders.

        Raises
        ------
        Refused
            If it is not signed, is too large, or cannot be decoded.
        """
        return _decoded(NotClaiming, self._verified("not-claiming", _parsed(text, MAX_EVENT_BYTES)))

    def sealed_directions(self, directions: Directions) -> str:
        """Return the text of the directions to the workers.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return json.dumps(self._sealed("directions", directions.model_dump(mode="json")))

    def open_directions(self, text: bytes) -> Directions:
        """Return the directions to the workers.

        Raises
        ------
        Refused
            If they are not signed, are too large, or cannot be decoded.
        """
        return _decoded(Directions, self._verified("directions", _parsed(text, MAX_PRESENCE_BYTES)))

    def sealed_preview_order(self, order: PreviewOrder) -> str:
        """Return the text of the order of a preview.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return json.dumps(self._sealed("preview-order", order.model_dump(mode="json")))

    def open_preview_order(self, text: bytes, *, worker: str) -> PreviewOrder:
        """Return the order of a preview that a worker has taken from its list.

        Raises
        ------
        Refused
            If it is not signed, is too large, cannot be decoded, or is for another worker.
        """
        order = _decoded(PreviewOrder, self._verified("preview-order", _parsed(text, MAX_ORDER_BYTES)))
        if order.worker != worker:
            raise Refused(f"the order of a preview for {order.worker} is in the list of {worker}")
        return order

    def sealed_preview_answer(self, answer: PreviewAnswer) -> str:
        """Return the text of the answer to the order of a preview.

        Raises
        ------
        NoKey
            If there is no key.
        """
        return json.dumps(self._sealed("preview-answer", answer.model_dump(mode="json", exclude_none=True)))

    def open_preview_answer(self, text: bytes, *, preview: str, worker: str) -> PreviewAnswer:
        """Return the answer of a worker to the order of a preview.

        Raises
        ------
        Refused
            If it is not signed, is too large, cannot be decoded, or is of another preview or worker.
        """
        fields = self._verified("preview-answer", _parsed(text, MAX_ANSWER_BYTES))
        self._check_worker("preview-answer", fields)
        answer = _decoded(PreviewAnswer, fields)
        if (answer.id, answer.worker) != (preview, worker):
            raise Refused(f"expected the answer of {worker} to {preview}, got that of {answer.worker} to {answer.id}")
        return answer

    def _sealed(self, purpose: Purpose, fields: Mapping[str, Any]) -> dict[str, Any]:
        keys = self.keys()
        if not keys:
            raise NoKey("expected a key to sign messages with, got none")
        if self.worker_key is not None:
            fields = {**fields, WORKER_KEY: self.worker_key.id}
            fields[WORKER_SEAL] = _seal(self.worker_key.message_key, purpose, fields)
        return {**fields, SEAL: _seal(keys[0], purpose, fields)}

    def _verified(self, purpose: Purpose, message: object) -> Mapping[str, Any]:
        if not isinstance(message, dict):
            raise Refused(f"the {purpose} is not an object")
        fields = {name: value for name, value in message.items() if name != SEAL}
        given = message.get(SEAL)
        if given is None and self.accept_unsigned:
            return fields
        if not isinstance(given, str) or not given.isascii():
            raise Refused(f"the {purpose} is not signed")
        try:
            is_valid = any(hmac.compare_digest(given, _seal(key, purpose, fields)) for key in self.keys())
        except (ValueError, TypeError, RecursionError) as error:
            raise Refused(f"the {purpose} has no canonical form") from error
        if not is_valid:
            raise Refused(f"the {purpose} has a wrong signature")
        return fields

    def _check_worker(self, purpose: Purpose, fields: Mapping[str, Any]) -> None:
        """Verify the own signature of a worker in a message that the key of the farm has signed.

        Raises
        ------
        Refused
            If the signature is wrong, or the message names a start of a worker with another key.
        KeyRefused
            If the farm refuses the key.
        """
        if self.find_worker_key is None:
            return
        key_id, given = fields.get(WORKER_KEY), fields.get(WORKER_SEAL)
        if key_id is not None and not isinstance(key_id, str):
            raise Refused(f"the {purpose} has no valid worker key")
        if key_of_instance(fields.get("instance")) != key_id:
            raise Refused(f"the {purpose} is not signed with the key of its worker")
        key = self.find_worker_key(key_id)
        if key_id is None:
            return
        signed = {name: value for name, value in fields.items() if name != WORKER_SEAL}
        is_text = isinstance(given, str) and given.isascii()
        if not is_text or not hmac.compare_digest(str(given), _seal(key, purpose, signed)):
            raise Refused(f"the {purpose} has a wrong signature of the worker key {key_id[:32]}")


def _seal(key: bytes, purpose: Purpose, fields: Mapping[str, Any]) -> str:
    return hmac.digest(key, purpose.encode() + b"\n" + canonical(fields), "sha256").hex()


def canonical(fields: Mapping[str, Any]) -> bytes:
    r"""Return the canonical JSON of a message, which is the same after it was encoded and decoded.

    >>> canonical({"b": [1, 2.0], "a": "é"})
    b'{"a":"\\u00e9","b":[1,2.0]}'
    """
    return json.dumps(fields, sort_keys=True, separators=(",", ":"), ensure_ascii=True, allow_nan=False).encode()


def _parsed(text: bytes, most_bytes: int) -> object:
    if len(text) > most_bytes:
        raise Refused(f"the message has {len(text)} bytes, more than {most_bytes}")
    if (values := text.count(b",") + 1) > MAX_MESSAGE_VALUES:  # Before a signature is checked, memory is bounded.
        raise Refused(f"the message has about {values} values, more than {MAX_MESSAGE_VALUES}")
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise Refused("the message is not JSON") from error


def _decoded(model: type[Model], fields: Mapping[str, Any]) -> Model:
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        raise Refused(f"the {model.__name__.lower()} is invalid: {first['loc']}: {first['msg']}") from error
