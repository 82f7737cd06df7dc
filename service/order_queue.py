"""The queue of orders: Celery messages, addressed by task name. In the service, Celery is used only here.

Publishing can block without end when the connection is half open, so every socket has a timeout, nothing is tried
twice, and only the scheduler publishes, in its own thread.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from celery import Celery
from kombu.exceptions import KombuError
from redis.exceptions import RedisError

from lippmann.errors import BadInput
from lippmann.job.messages import wire
from lippmann.job.messages.orders import Order
from lippmann.job.messages.seals import NoKey, Seals
from lippmann.telemetry import context_of_job, span
from service.errors import BrokerUnavailable


class OrderQueue:
    """The queue of orders to the workers, which are signed."""

    def __init__(
        self, redis_url: str, *, seals: Seals, timeout_s: float, clock: Callable[[], float] = time.time
    ) -> None:
        self._celery = _celery(redis_url, timeout_s)
        self._producer: Any = None
        self._seals = seals
        self._clock = clock

    def publish(self, orders: Sequence[Order]) -> None:
        """Send orders in one exchange, over a connection that is kept until it fails.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer, or there is no key. Some of the orders may have been sent.
        """
        if not orders:
            return
        try:
            if self._producer is None:
                self._connect()
            with self._producer.batch(max_size=len(orders)):
                for order in orders:
                    self._send(self._producer, order)
        except (KombuError, RedisError, OSError) as error:
            self._disconnect()
            raise BrokerUnavailable(f"expected the broker to take {len(orders)} orders, got {error!r}") from error
        except (NoKey, BadInput) as error:
            raise BrokerUnavailable(f"{len(orders)} orders cannot be signed: {error}") from error

    def close(self) -> None:
        """Close every connection."""
        self._disconnect()
        self._celery.close()

    def _connect(self) -> None:
        connection = self._celery.connection_for_write()
        try:
            connection.ensure_connection(max_retries=1, interval_start=0, interval_step=0, timeout=0.1)
            self._producer = self._celery.amqp.Producer(connection)
        except BaseException:
            connection.release()
            raise

    def _disconnect(self) -> None:
        producer, self._producer = self._producer, None
        if producer is not None:
            producer.connection.release()

    def _send(self, producer: Any, order: Order) -> None:
        about = {"job": order.job_id, "task": order.task_id, "attempt": order.attempt, "kind": order.kind}
        with span("order", parent=context_of_job(order.job_id), **about) as made:
            if made.context is not None:
                order = order.model_copy(update={"trace": made.context})
            self._publish(producer, order)

    def _publish(self, producer: Any, order: Order) -> None:
        self._celery.send_task(
            wire.task_name(order.kind),
            kwargs={"order": self._seals.sealed_order(order, now_s=self._clock())},
            task_id=order.attempt,
            queue=wire.queue_of(order.requirement),
            producer=producer,
            ignore_result=True,
            retry=False,
            # Celery would describe the order for logs that nobody reads, which costs more than all the rest.
            argsrepr="()",
            kwargsrepr="{}",
            # The workers declare the queue; a message that names it needs no exchange.
            declare=(),
        )


def _celery(redis_url: str, timeout_s: float) -> Celery:
    celery = Celery("lippmann-service", broker=wire.broker_url(redis_url), set_as_current=False)
    celery.conf.update(
        task_serializer="json",
        accept_content=["json"],
        task_ignore_result=True,
        task_publish_retry=False,
        task_default_queue=wire.QUEUE,
        task_create_missing_queues=True,
        broker_connection_timeout=timeout_s,
        broker_transport_options={
            "global_keyprefix": wire.CARRIER_PREFIX,
            "socket_timeout": timeout_s,
            "socket_connect_timeout": timeout_s,
            "retry_on_timeout": False,
            "max_retries": 0,
        },
    )
    return celery
