"""The consumer takes orders from the broker. It proves that it polls, and it connects again when it does not.

The queue forgets an order when a worker takes it: no order is acknowledged. An acknowledgement that fails leaves
Celery's consumer without credit for another order, and without credit it polls no connection and notices no outage.
The service takes back an order that no worker claims, so an acknowledgement would protect nothing.
"""

from __future__ import annotations

import signal
from collections.abc import Callable
from queue import Empty
from time import monotonic, sleep
from typing import Any

from celery.utils.log import get_logger
from celery.worker import state
from celery.worker.consumer import Consumer
from kombu.entity import Queue
from redis.exceptions import AuthenticationError, NoPermissionError, RedisError, ResponseError

from lippmann.job.messages import wire
from lippmann.job.messages.events import Directions
from lippmann.job.messages.orders import TaskKind
from lippmann.job.messages.wire import task_name
from worker.duty import Duty
from worker.handover import Handover
from worker.liveness import ConsumerLiveness
from worker.refusals import refusals

RETRY_S = 1.0
"""The pause between two attempts to connect to the broker."""
TICK_S = 1.0
"""The interval at which the consumer examines itself. The broker answers a poll within a second, with or without an
order."""
SILENT_S = 10.0
"""The time without an answer after which the connection is made again. Ticks do not measure it: while the broker is
silent, each of them waits for the answers of its own questions."""
SILENT_TICKS = 3
"""The least number of ticks in that time: a process that stood still has asked nothing meanwhile."""

ORDERS = frozenset(map(task_name, TaskKind))
FOREIGN = (ValueError, LookupError, TypeError, AttributeError, RecursionError)
"""The errors by which Celery's transport ends at an item of the queue that it did not write."""

log = get_logger(__name__)


class NotPolling(ConnectionError):
    """The consumer has a free slot, and the broker answers no poll."""


class OrderConsumer(Consumer):  # type: ignore[misc]  # Celery has no types
    """The consumer of Celery with proof of its polls, and with slots that are handed over.

    Parameters
    ----------
    liveness
        The record of what this consumer does; it publishes the presence of the worker.
    handover
        The announcements of attempts that end.
    slots
        The number of attempts that may be held beside those that end.
    duty
        The rule whether orders are taken, and from which queues.
    find_directions
        Returns the directions of the service.
    look_after_previews
        Starts the process that renders previews if it is needed; the argument is whether the worker takes orders.
    """

    def __init__(
        self,
        liveness: ConsumerLiveness,
        handover: Handover,
        slots: int,
        duty: Duty,
        find_directions: Callable[[], Directions | None],
        look_after_previews: Callable[[bool], None],
        *args: Any,
        **options: Any,
    ) -> None:
        self._liveness = liveness
        self._duty = duty
        self._find_directions = find_directions
        self._look_after_previews = look_after_previews
        self._handover = handover
        self._slots = slots
        self._silent_ticks, self._answered_s = 0, monotonic()
        self._is_outage_logged = self._is_denial_logged = False
        super().__init__(*args, **options)

    def ensure_connected(self, conn: Any) -> Any:
        """Connect to the broker, with a short pause between attempts however long the broker is unreachable.

        Raises
        ------
        WorkerShutdown
            If the worker shall end, also because it is drained and holds no attempt or has no more time.
        """
        connected = conn.ensure_connection(
            self._record_refusal,
            None,
            interval_start=RETRY_S,
            interval_step=0,
            interval_max=RETRY_S,
            callback=self._end_while_away,
        )
        self.first_connection_attempt = self._is_outage_logged = False
        return connected

    def on_connection_error_before_connected(self, exc: Exception) -> None:
        """Wait if the broker refuses what Celery asks when it connects."""
        super().on_connection_error_before_connected(exc)
        self._wait_if_refused(exc)

    def on_connection_error_after_connected(self, exc: Exception) -> None:
        """Wait if the broker refuses what Celery asks on a connection."""
        super().on_connection_error_after_connected(exc)
        self._wait_if_refused(exc)

    def read_directions(self) -> Directions | None:
        """Return the directions of the service; None if the broker gives none, so that those of before hold."""
        try:
            found = self._find_directions()
        except NoPermissionError as error:
            if not self._is_denial_logged:
                log.error(
                    "the user of this worker at the broker has no right to %s, so tags and drains do nothing here; "
                    "renew the users of the broker from deploy/broker-users.acl: %s",
                    wire.DIRECTIONS, error,
                )  # fmt: skip
            self._is_denial_logged = True
            return None
        except RedisError:
            return None
        self._is_denial_logged = False
        return found

    def update_strategies(self) -> None:
        """Accept only the tasks of orders: Celery also knows tasks of its own, which call other tasks."""
        super().update_strategies()
        for name in self.strategies.keys() - ORDERS:
            del self.strategies[name]

    def on_unknown_message(self, body: Any, message: Any) -> None:
        """Count a message that Celery did not write."""
        refusals.record("a message without a task")

    def on_unknown_task(self, body: Any, message: Any, exc: Exception) -> None:
        """Count a message that asks for another task."""
        refusals.record(f"an unknown task: {exc}")

    def on_invalid_task(self, body: Any, message: Any, exc: Exception) -> None:
        """Count a message with an invalid body."""
        refusals.record(f"an invalid message: {exc}")

    def on_decode_error(self, message: Any, exc: Exception) -> None:
        """Count a message that cannot be decoded."""
        refusals.record(f"a message that cannot be decoded: {exc}")

    def call_soon_ack(self, p: Any, *args: Any, **options: Any) -> None:
        """Do nothing: orders are not acknowledged."""

    def register_with_event_loop(self, hub: Any) -> None:
        """Begin to watch the polls of a new connection."""
        super().register_with_event_loop(hub)
        self._silent_ticks, self._answered_s = 0, monotonic()
        channel = self.task_consumer.channel
        channel.handlers["BRPOP"] = self._recorded(channel.handlers["BRPOP"])
        channel.qos.can_consume = self._with_free_slot(channel.qos.can_consume)
        hub.add_reader(self._handover.fileno(), self._handover.read)
        hub.call_repeatedly(TICK_S, self._tick)

    def _with_free_slot(self, can_consume: Callable[[], bool]) -> Callable[[], bool]:
        """Return a function that allows to take an order if there is a free slot, and a pool process for it."""

        def can_consume_with_free_slot() -> bool:
            return self._has_free_slot() and can_consume()

        return can_consume_with_free_slot

    def _has_free_slot(self) -> bool:
        """Return whether an order may be taken: a slot is free, and the worker is not closed."""
        return (
            self._duty.closed is None
            and self._handover.occupied(request.id for request in state.reserved_requests) < self._slots
        )

    def _recorded(self, read: Any) -> Any:
        """Return a function that reads the answer to a poll and records it."""

        def read_and_record() -> Any:
            try:
                delivered = read()
            except Empty:  # the answer after a second without an order
                self._record_poll()
                raise
            except FOREIGN as error:  # the item was taken from the queue, and the next poll follows
                refusals.record(f"no message of Celery: {error!r}")
                self._record_poll()
                return False
            self._record_poll()
            self._liveness.record_order()
            return delivered

        return read_and_record

    def _record_poll(self) -> None:
        self._silent_ticks, self._answered_s = 0, monotonic()
        self._liveness.record_poll()

    def _record_refusal(self, error: Exception, pause_s: float) -> None:
        self._liveness.record_refusal()
        if not self._is_outage_logged:
            is_unknown = isinstance(error, AuthenticationError)
            what = "refuses the user of this worker, whose key may be revoked," if is_unknown else "does not answer,"
            log.warning("the broker %s and is tried every %g s: %s", what, pause_s, error)
        self._is_outage_logged = True

    def _wait_if_refused(self, error: Exception) -> None:
        """Record an error with which the broker answered, and wait for a moment.

        A broker that only reads, or has no memory left, answers PING, so every attempt to connect succeeds, and what
        follows is refused before there is a tick.

        Raises
        ------
        WorkerShutdown
            If the worker shall end.
        """
        if isinstance(error, ResponseError):
            self._liveness.record_refusal()
            self._end_while_away()
            sleep(RETRY_S)

    def _tick(self) -> None:
        """Publish the presence, and look for dead pool processes; connect again if the broker answers no poll.

        Raises
        ------
        NotPolling
            If there is a free slot and no answer. Celery then connects anew, because it is a ConnectionError.
        """
        holds = tuple(sorted(request.id for request in state.reserved_requests))
        self._follow_directions(held=len(holds))
        if not self._has_free_slot() or len(holds) >= self.pool.num_processes:
            self._record_poll()  # no slot is free, so there is nothing to poll for
        self._silent_ticks += 1
        self.pool.maintain_pool()  # Celery does it every 5 s, which delays the report of a lost attempt
        self._liveness.publish(holds=holds, closed=self._duty.closed, opens_s=self._duty.opens_s)
        self._look_after_previews(self._duty.closed is None)
        if self._silent_ticks >= SILENT_TICKS and monotonic() - self._answered_s > SILENT_S:
            raise NotPolling(f"expected an answer of the broker within {SILENT_S:g} s, got none")

    def _follow_directions(self, *, held: int) -> None:
        """Take orders from the queues that this worker shall take them from, and end if it has been drained."""
        directions = self.read_directions()
        if directions is not None:
            self._duty.follow(directions)
        self._duty.refresh()
        for name in self._duty.queues:
            if not self.task_consumer.consuming_from(name):
                self.task_consumer.add_queue(Queue(name, no_ack=True))  # type: ignore[no-untyped-call]
                self.task_consumer.consume()
        for name in {queue.name for queue in self.task_consumer.queues} - self._duty.queues:
            self.task_consumer.cancel_by_queue(name)
        self._end_if_drained(held=held)

    def _end_if_drained(self, *, held: int) -> None:
        if self._duty.may_end(held=held):
            signal.raise_signal(signal.SIGTERM)

    def _end_while_away(self) -> None:
        """End if the worker shall, while the broker is away and there are no ticks: no poll could bring an order."""
        self._duty.refresh()
        self._end_if_drained(held=len(state.reserved_requests))
        state.maybe_shutdown()
