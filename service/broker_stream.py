"""Redis apart from the order queue: the stream of worker events, the presence of workers, and stop signals.

Every exchange has a timeout and no exchange is repeated here; the callers try again in their next round.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from typing import Any

import redis
import structlog
from redis.backoff import NoBackoff
from redis.exceptions import NoPermissionError, RedisError, ResponseError
from redis.retry import Retry

from lippmann.errors import InvalidText
from lippmann.job.messages import wire
from lippmann.job.messages.events import Directions, Event, Lease, NotClaiming, Presence
from lippmann.job.messages.seals import Refused, Seals, Unverifiable
from lippmann.job.messages.worker_keys import KEY_ID, KEY_REFUSAL
from lippmann.untrusted.json_text import JsonLimits, read_json
from service.errors import BrokerUnavailable, DatabaseUnavailable

MAX_WORKERS = 10_000
"""The largest number of workers that are read; the others are not online."""
LOG_S = 10.0
"""The interval at which the log says how many messages were dropped."""

QUICK_S = 0.5
"""The longest time that a request waits for the broker."""

log = structlog.get_logger("service.broker_stream")

Entry = tuple[str, Event | None]

_MESSAGE = JsonLimits(size_bytes=64_000_000)
"""The limits of an order in the queue; the order itself is one text in it."""


NEVER_EVICTS = "noeviction"
"""The policy of a broker that refuses to store more when its memory is full."""


@dataclass(frozen=True)
class BrokerKeeping:
    """The ways in which the broker may lose data of the farm."""

    evicts: str | None
    """The policy by which it removes keys when its memory is full; None if it removes none."""
    has_append_only_file: bool
    """False if a restart loses orders and events. The farm then sends orders again, and repeats what was reported."""


class Stream:
    """The events, presences and stop signals in the broker."""

    def __init__(
        self, redis_url: str, *, seals: Seals, timeout_s: float, steady: Callable[[], float] = time.monotonic
    ) -> None:
        self.dropped: Counter[str] = Counter()
        """The number of messages that were not accepted, by their kind."""
        self._seals = seals
        self._steady = steady
        self._logged_s = float("-inf")
        self._slow = _client(redis_url, timeout_s)
        self._quick = _client(redis_url, QUICK_S)

    def read(self, position: str, *, count: int, block_s: float) -> list[Entry]:
        """Return the events after a position, as pairs (position, event), with None for one that is refused."""
        with _translated():
            answer: Any = self._slow.xread({wire.EVENTS_STREAM: position}, count=count, block=math.ceil(block_s * 1000))
        return [(entry.decode(), self._event(fields)) for _, entries in answer for entry, fields in entries]

    def presences(self) -> tuple[Presence, ...]:
        """Return the workers that are online, sorted by name."""
        with _translated():
            keys = list(islice(self._quick.scan_iter(match=wire.presence_key("*"), count=1000), MAX_WORKERS))
            texts: Any = self._quick.mget(keys) if keys else []
        found = (self._presence(key, text) for key, text in zip(keys, texts, strict=True) if text is not None)
        return tuple(sorted((presence for presence in found if presence), key=lambda presence: presence.name))

    def refused_keys(self) -> tuple[str, ...]:
        """Return the worker keys with which workers were refused in the last minute, sorted by id."""
        prefix = wire.stop_key(KEY_REFUSAL)
        with _translated():
            found = [key.decode() for key in islice(self._quick.scan_iter(match=f"{prefix}*", count=1000), MAX_WORKERS)]
        ids = (key.removeprefix(prefix) for key in found)
        return tuple(sorted(key_id for key_id in ids if KEY_ID.fullmatch(key_id)))

    def first_order(self, requirement: str = "") -> bytes | None:
        """Return the message that the next poll of the queue of a requirement gets; None if no order waits."""
        with _translated():
            first: Any = self._quick.lindex(wire.CARRIER_PREFIX + wire.queue_of(requirement), -1)
            return first  # type: ignore[no-any-return]

    def first_orders(self, requirements: Iterable[str]) -> dict[str, bytes | None]:
        """Return the first message of the queue of each requirement, as `first_order` does, in one exchange."""
        asked = tuple(requirements)
        with _translated():
            pipe = self._quick.pipeline(transaction=False)
            for requirement in asked:
                pipe.lindex(wire.CARRIER_PREFIX + wire.queue_of(requirement), -1)
            return dict(zip(asked, pipe.execute(), strict=True))

    def delete_queue(self, requirement: str) -> None:
        """Delete the orders in the queue of a requirement that no open job has any more."""
        with _translated():
            self._quick.delete(wire.CARRIER_PREFIX + wire.queue_of(requirement))

    def publish_directions(self, directions: Directions) -> None:
        """Publish the directions to the workers."""
        with _translated():
            self._quick.set(wire.DIRECTIONS, self._seals.sealed_directions(directions))

    def leases(self, attempts: Sequence[str]) -> Mapping[str, Lease | None]:
        """Return the leases of attempts; None for one that has expired, was released, or is refused."""
        if not attempts:
            return {}
        with _translated():
            texts: Any = self._quick.mget([wire.lease_key(attempt) for attempt in attempts])
        return {attempt: self._lease(attempt, text) for attempt, text in zip(attempts, texts, strict=True)}

    def publish_not_claiming(self, since_s: Mapping[str, float]) -> None:
        """Publish which workers take no orders, with the time since when, to every process of the service."""
        with _translated():
            if since_s:
                ttl_ms = math.ceil(1000 * wire.NOT_CLAIMING_TTL_S)
                text = self._seals.sealed_not_claiming(NotClaiming(since_s=dict(since_s)))
                self._quick.set(wire.NOT_CLAIMING, text, px=ttl_ms)
            else:
                self._quick.delete(wire.NOT_CLAIMING)

    def not_claiming(self) -> Mapping[str, float]:
        """Return which workers take no orders, with the time since when."""
        with _translated():
            text: Any = self._quick.get(wire.NOT_CLAIMING)
        try:
            return {} if text is None else self._seals.open_not_claiming(text).since_s
        except Refused as error:
            self._drop("not-claiming", error)
            return {}

    def stop(self, attempts: Sequence[str], *, ttl_s: float) -> None:
        """Signal attempts to stop."""
        with _translated():
            pipe = self._slow.pipeline(transaction=False)
            for attempt in attempts:
                pipe.set(wire.stop_key(attempt), self._seals.sealed_stop(attempt), ex=math.ceil(ttl_s))
            pipe.execute()

    def is_new(self) -> bool:
        """Return whether the broker lost its data since it was marked.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer, or takes no data.
        """
        with _translated():
            return not self._slow.set(wire.MARKER, "1", xx=True)

    def mark(self) -> None:
        """Mark the broker as one whose lost orders have been taken back."""
        with _translated():
            self._slow.set(wire.MARKER, "1")

    def write_error(self) -> str | None:
        """Return why the broker answers but takes no orders and events, such as a full disk; None if it takes them."""
        try:
            self._quick.ping()
        except ResponseError as error:
            reason = str(error)
            return reason.removeprefix("MISCONF ") if reason.startswith("MISCONF") else None
        except (RedisError, OSError):
            return None  # it does not answer at all, which is another matter
        return None

    def keeping(self) -> BrokerKeeping | None:
        """Return how well the broker keeps what it is given; None if its user has no right to know."""
        with _translated():
            try:
                memory: Any = self._quick.info("memory")
                persistence: Any = self._quick.info("persistence")
            except NoPermissionError:
                return None
        policy = str(memory.get("maxmemory_policy", NEVER_EVICTS))
        is_limited = int(memory.get("maxmemory", 0)) > 0
        evicts = policy if is_limited and policy != NEVER_EVICTS else None
        return BrokerKeeping(evicts, has_append_only_file=bool(int(persistence.get("aof_enabled", 1))))

    def ping(self) -> None:
        """Raise BrokerUnavailable if the broker does not answer."""
        with _translated():
            self._quick.ping()

    def close(self) -> None:
        """Close every connection."""
        self._slow.close()
        self._quick.close()

    def _event(self, fields: Mapping[bytes, bytes]) -> Event | None:
        try:
            return self._seals.open_event(fields.get(b"event", b""))
        except Unverifiable as error:  # It may be right, so it is read again and not dropped.
            raise DatabaseUnavailable(str(error)) from error
        except Refused as error:
            self._drop("event", error)
            return None

    def _presence(self, key: bytes, text: bytes) -> Presence | None:
        try:
            return self._seals.open_presence(text, key=key)
        except Refused as error:
            self._drop("presence", error)
            return None

    def _lease(self, attempt: str, text: bytes | None) -> Lease | None:
        try:
            return None if text is None else self._seals.open_lease(text, attempt=attempt)
        except Refused as error:
            self._drop("lease", error)
            return None

    def _drop(self, kind: str, error: Refused) -> None:
        self.dropped[kind] += 1
        if self._steady() - self._logged_s >= LOG_S:
            self._logged_s = self._steady()
            log.warning("messages of workers were dropped", dropped=dict(self.dropped), last=str(error)[:500])


def evicting_text(policy: str) -> str:
    """Return the sentence about a broker that removes keys when its memory is full."""
    return (
        f"The broker removes orders and events when its memory is full: expected maxmemory-policy {NEVER_EVICTS}, "
        f"got {policy}."
    )


def attempt_of(message: bytes | None) -> str | None:
    """Return the attempt of a message in the queue; empty for a message that is no order, None for no message.

    >>> attempt_of(b'{"headers": {"id": "a1"}}')
    'a1'
    """
    if message is None:
        return None
    try:
        return str(read_json(message, field="order", limits=_MESSAGE)["headers"]["id"])
    except (InvalidText, KeyError, TypeError):
        return ""


@contextmanager
def _translated() -> Iterator[None]:
    try:
        yield
    except (RedisError, OSError) as error:
        raise BrokerUnavailable(f"the broker does not answer: {error}") from error


def _client(url: str, timeout_s: float) -> redis.Redis:
    return redis.Redis.from_url(
        url, protocol=2, socket_timeout=timeout_s, socket_connect_timeout=timeout_s, retry=Retry(NoBackoff(), 0)
    )
