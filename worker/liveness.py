"""The signs of life of a worker. Only the consumer gives them, so that a worker that takes no orders seems to be dead.

The heartbeat file is touched while the broker answers the polls of the consumer, and while the broker refuses its
connections: then a restart would change nothing. The presence is published by the event loop of the consumer. A
consumer that shows neither sign for `STUCK_S` cannot help itself, and the process ends to be started again.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path

import structlog
from redis.exceptions import RedisError

from lippmann.errors import BadInput
from lippmann.job.messages import wire
from lippmann.job.messages.events import Presence, PresenceFault
from lippmann.job.messages.seals import NoKey
from worker.report import BrokerClient

STUCK_S = 60.0
"""The time without a sign of the consumer after which the worker ends."""
STOP_S = 8.0
"""The time that running attempts have for their final events when the worker ends."""
HUNG_S = 2.0
"""The time that the log has besides, and the disk for the file that stops the attempts; what hangs never answers."""
EXIT_STUCK = 75
"""The exit code of a worker whose consumer is stuck: EX_TEMPFAIL of sysexits.h."""

log = structlog.get_logger()


class ConsumerLiveness:
    """The latest acts of the consumer of a worker. All methods are called in its event loop."""

    def __init__(
        self,
        broker: BrokerClient,
        presence: Presence,
        heartbeat_file: Path | None,
        *,
        find_fault: Callable[[], PresenceFault | None] = lambda: None,
        refused: Callable[[], int] = lambda: 0,
        on_key_refused: Callable[[], None] = lambda: None,
        clock: Callable[[], float] = time.time,
    ) -> None:
        self._find_fault = find_fault
        self._refused = refused
        self._on_key_refused = on_key_refused
        self._is_unsigned_logged = False
        self.signs = 0
        """The number of answered polls and of refusals; the consumer is stuck while it does not grow."""
        self._broker = broker
        self._presence = presence
        self._heartbeat_file = heartbeat_file
        self._clock = clock
        self._next_s = 0.0

    def record_poll(self) -> None:
        """Record that the broker answered a poll, or that no slot is free and nothing is to be polled for."""
        self._presence = self._presence.model_copy(update={"consuming_s": self._clock()})
        self._record_sign()

    def record_order(self) -> None:
        """Record that an order was taken."""
        self._presence = self._presence.model_copy(update={"order_s": self._clock()})

    def record_refusal(self) -> None:
        """Record that the broker refused a connection, or what was asked on one, or did not answer in time."""
        self._record_sign()

    def publish(self, *, holds: tuple[str, ...], closed: str | None = None, opens_s: float | None = None) -> None:
        """Publish the presence every few seconds, and when the attempts change, or whether the worker takes orders.

        Parameters
        ----------
        holds
            The attempts that the worker holds.
        closed, opens_s
            The reason why it takes no orders, and the time at which it takes some again, as in the presence.
        """
        now_s = self._clock()
        is_due = not 0 <= self._next_s - now_s <= wire.HEARTBEAT_S
        if not is_due and (holds, closed) == (self._presence.holds, self._presence.closed):
            return
        self._next_s = now_s + wire.HEARTBEAT_S
        self._presence = self._presence.model_copy(
            update={
                "seen_s": now_s, "holds": holds, "fault": self._find_fault(), "refused_orders": self._refused(),
                "closed": closed, "opens_s": opens_s, "load": _load(),
            }
        )  # fmt: skip
        # While Redis is unreachable, or there is no key yet, the next presence is tried in a few seconds.
        try:
            self._broker.publish_presence(self._presence)
            self._is_unsigned_logged = False
            if self._broker.is_key_refused(self._presence.worker_key):
                self._on_key_refused()
        except RedisError:
            return
        except (NoKey, BadInput) as error:
            if not self._is_unsigned_logged:
                log.warning("the worker cannot say that it is online", error=str(error))
            self._is_unsigned_logged = True

    def remove(self) -> None:
        """Remove the presence, because the worker has ended."""
        self._broker.remove_presence()

    def _record_sign(self) -> None:
        self.signs += 1
        if self._heartbeat_file:
            with contextlib.suppress(OSError):  # a disk that cannot be written is told by the fault
                self._heartbeat_file.touch()


def _load() -> float | None:
    """Return the load average of the machine over the last minute; None where the system does not say it."""
    try:
        return round(os.getloadavg()[0], 2)
    except OSError:
        return None


class StuckWatch:
    """A thread that ends the process when the consumer gives no sign of life."""

    def __init__(
        self, liveness: ConsumerLiveness, stopping_file: Path, *, stuck_s: float = STUCK_S, stop_s: float = STOP_S
    ) -> None:
        self._liveness = liveness
        self._stopping_file = stopping_file
        self._stuck_s = stuck_s
        self._stop_s = stop_s
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="stuck-watch", daemon=True)

    def start(self) -> None:
        """Start to watch."""
        self._thread.start()

    def stop(self) -> None:
        """Stop to watch, because the worker is shutting down."""
        self._ended.set()

    def _watch(self) -> None:
        # Seconds are counted here rather than read from a clock: time in which the whole process was stopped is not
        # the fault of the consumer.
        silent_s, signs = 0.0, self._liveness.signs
        while not self._ended.wait(1.0):
            silent_s = silent_s + 1.0 if signs == self._liveness.signs else 0.0
            signs = self._liveness.signs
            if silent_s > self._stuck_s:
                self._exit()

    def _exit(self) -> None:
        """End the process. What stands still may be the log or the disk, so other threads write there."""
        try:
            threads = [threading.Thread(target=act, daemon=True) for act in (self._say_why, self._end_attempts)]
            for thread in threads:
                thread.start()
            threads[-1].join(self._stop_s + HUNG_S)
            threads[0].join(HUNG_S)
        finally:
            os._exit(EXIT_STUCK)

    def _say_why(self) -> None:
        log.critical(
            f"expected the consumer to poll the broker, got no sign of it for {self._stuck_s:g} s; "
            "the worker ends to be started again"
        )

    def _end_attempts(self) -> None:
        with contextlib.suppress(OSError):
            self._stopping_file.touch()
        self._ended.wait(self._stop_s)
        with contextlib.suppress(OSError):
            self._stopping_file.unlink(missing_ok=True)
