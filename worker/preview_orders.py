"""The orders of previews for one worker, over Redis. A preview is worth nothing later, so nothing is tried twice."""

from __future__ import annotations

from typing import Any

from redis import Redis

from lippmann.job.messages import wire
from lippmann.job.messages.previews import PreviewAnswer, PreviewOrder
from lippmann.job.messages.seals import Refused, Seals
from worker.refusals import refusals

TIMEOUT_S = 2.0
"""The longest time of one exchange with Redis, besides the wait for an order."""


class PreviewOrders:
    """The list of the orders of previews for a worker."""

    def __init__(
        self, redis_url: str, worker: str, instance: str | None, *, seals: Seals, timeout_s: float = TIMEOUT_S
    ) -> None:
        self._worker = worker
        self._instance = instance
        self._seals = seals
        self._redis = Redis.from_url(redis_url, socket_timeout=timeout_s, socket_connect_timeout=timeout_s)

    def are_waiting(self) -> bool:
        """Return whether an order waits.

        Raises
        ------
        RedisError
            If the broker does not answer, or its user has no right to previews.
        """
        waiting: Any = self._redis.llen(wire.preview_orders_key(self._worker))
        return bool(waiting)

    def take(self, wait_s: float) -> PreviewOrder | None:
        """Take the oldest order, unless nobody waits for it any more.

        Parameters
        ----------
        wait_s
            The longest time to wait for one, less than `TIMEOUT_S`.

        Returns
        -------
        PreviewOrder or None
            None without an order that counts.

        Raises
        ------
        RedisError
            If the broker does not answer.
        """
        taken: Any = self._redis.brpop([wire.preview_orders_key(self._worker)], timeout=wait_s)
        if taken is None:
            return None
        try:
            order = self._seals.open_preview_order(taken[1], worker=self._worker)
        except Refused as error:
            refusals.record(error)
            return None
        return order if self.is_wanted(order.id) else None

    def is_wanted(self, preview: str) -> bool:
        """Return whether the service still waits for a preview.

        Raises
        ------
        RedisError
            If the broker does not answer.
        """
        return bool(self._redis.exists(wire.preview_wanted_key(preview)))

    def answer(self, answer: PreviewAnswer) -> None:
        """Send the answer to an order.

        Raises
        ------
        RedisError
            If the broker does not answer.
        """
        signed = answer.model_copy(update={"worker": self._worker, "instance": self._instance})
        key = wire.preview_answer_key(answer.id)
        pipe = self._redis.pipeline(transaction=False)
        pipe.lpush(key, self._seals.sealed_preview_answer(signed))
        pipe.pexpire(key, round(1000 * wire.PREVIEW_TTL_S))
        pipe.execute()

    def close(self) -> None:
        """Close every connection."""
        self._redis.close()
