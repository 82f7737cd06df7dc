"""The orders of previews and their answers, over Redis, with the newest preview of each series."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import redis
import structlog
from redis.backoff import NoBackoff
from redis.exceptions import NoPermissionError, RedisError
from redis.retry import Retry

from lippmann.errors import BadInput
from lippmann.job.messages import wire
from lippmann.job.messages.previews import PreviewAnswer, PreviewOrder
from lippmann.job.messages.seals import NoKey, Refused, Seals
from service.errors import BrokerUnavailable

TIMEOUT_S = 1.0
"""The longest time of one exchange, besides the wait for an answer."""

log = structlog.get_logger("service.previews")


class PreviewBroker:
    """Sends the orders of previews and receives the answers."""

    def __init__(self, redis_url: str, *, seals: Seals) -> None:
        self._seals = seals
        self._redis = redis.Redis.from_url(
            redis_url, protocol=2, socket_timeout=TIMEOUT_S, socket_connect_timeout=TIMEOUT_S,
            retry=Retry(NoBackoff(), 0),
        )  # fmt: skip

    def send(self, order: PreviewOrder, *, series: str) -> None:
        """Send an order to its worker; the preview before it in the series is not wanted any more.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer, or there is no key.
        """
        newest, orders = wire.preview_newest_key(_digest(series)), wire.preview_orders_key(order.worker)
        wanted_ms, kept_ms = math.ceil(1000 * order.timeout_s), round(1000 * wire.PREVIEW_TTL_S)
        try:
            text = self._seals.sealed_preview_order(order)
        except (NoKey, BadInput) as error:
            raise BrokerUnavailable(f"the order of a preview cannot be signed: {error}") from error
        with _translated():
            before: Any = self._redis.get(newest)
            pipe = self._redis.pipeline(transaction=False)
            if isinstance(before, bytes):
                pipe.delete(wire.preview_wanted_key(before.decode(errors="replace")))
            pipe.set(newest, order.id, px=kept_ms)
            pipe.set(wire.preview_wanted_key(order.id), "1", px=wanted_ms)
            pipe.lpush(orders, text)
            pipe.pexpire(orders, kept_ms)
            pipe.execute()

    def is_newest(self, preview: str, *, series: str) -> bool:
        """Return whether no newer preview of the series was asked for, in any process of the service.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        with _translated():
            newest: Any = self._redis.get(wire.preview_newest_key(_digest(series)))
        return newest in (None, preview.encode())  # the broker may have been wiped

    def answer(self, preview: str, *, worker: str, wait_s: float) -> PreviewAnswer | None:
        """Return the answer to a preview; None if none comes within a time shorter than `TIMEOUT_S`.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        with _translated():
            taken: Any = self._redis.brpop([wire.preview_answer_key(preview)], timeout=wait_s)
        if taken is None:
            return None
        try:
            return self._seals.open_preview_answer(taken[1], preview=preview, worker=worker)
        except Refused as error:
            log.warning("the answer to a preview was dropped", reason=str(error)[:500])
            return None

    def drop(self, preview: str) -> None:
        """Make a worker skip or stop a preview that nobody waits for any more; a broker that is away forgets it."""
        try:
            self._redis.delete(wire.preview_wanted_key(preview), wire.preview_answer_key(preview))
        except (RedisError, OSError):
            return

    def close(self) -> None:
        """Close every connection."""
        self._redis.close()


def _digest(series: str) -> str:
    return hashlib.sha256(series.encode()).hexdigest()[:32]


@contextmanager
def _translated() -> Iterator[None]:
    try:
        yield
    except NoPermissionError as error:
        raise BrokerUnavailable(
            "the user of the service at the broker has no right to previews; renew the users of the broker from "
            f"deploy/broker-users.acl: {error}"
        ) from error
    except (RedisError, OSError) as error:
        raise BrokerUnavailable(f"the broker does not answer: {error}") from error
