"""A worker's communication with the service over Redis: leases, stop requests, events and presence.

Redis may be unreachable or wiped at any moment. Then a lease is not held, a heartbeat is missing and a final event
comes late: the service notices the silence and the artifact, and the work goes on meanwhile.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Any, Self, TypeVar

from redis import Redis
from redis.backoff import ExponentialBackoff
from redis.exceptions import RedisError
from redis.retry import Retry

from lippmann.digest import Digest
from lippmann.job.messages import wire
from lippmann.job.messages.events import (
    MAX_LEASE_BYTES,
    Directions,
    Event,
    EventKind,
    Failure,
    Lease,
    Presence,
    ProbeResult,
)
from lippmann.job.messages.orders import Order
from lippmann.job.messages.seals import Refused, Seals
from lippmann.job.messages.worker_keys import key_refusal
from worker.refusals import refusals

START_S = 60.0
"""The time for which an attempt waits for Redis before it begins; the service takes the order back about then."""
STOPPING_S = 3.0
"""The time that these retries have left once the worker is stopping."""
TIMEOUT_S = 2.0
"""The longest time of one exchange with Redis."""
QUICK_S = 1.0
"""The longest time of one exchange that holds up the event loop of the consumer."""
JOIN_S = 2.0
"""The time that the last heartbeat has to end. One that ends later comes after the final event and changes nothing."""

MOST_TRIES = 10
"""The number of forged stop signals and leases that are refused while one attempt is claimed."""

_TEXT = f"""
local function text(key)
  local value = redis.pcall('GET', key)
  if type(value) == 'table' then return 'no text' end
  return value and string.sub(value, 1, {MAX_LEASE_BYTES + 1})
end
"""
"""The beginning of the scripts: the value of a key that anybody may have written, which is cut."""
_CLAIM = f"""{_TEXT}
local stop = text(KEYS[1])
if stop and stop ~= ARGV[5] then return {{'stop', stop}} end
local lease = text(KEYS[2])
if lease and lease ~= ARGV[1] and lease ~= ARGV[6] then return {{'lease', lease}} end
redis.call('SET', KEYS[2], ARGV[1], 'PX', ARGV[2])
redis.call('XADD', KEYS[3], 'MAXLEN', '~', ARGV[3], '*', 'event', ARGV[4])
return {{}}
"""
"""The script of `BrokerClient.claim`: the keys of stop signal, lease and stream; lease, its time, length, event, and a
stop signal and a lease that were refused. It returns what is in the way, if anything is."""
_RENEW = f"""{_TEXT}
redis.call('SET', KEYS[1], ARGV[1], 'PX', ARGV[2])
return text(KEYS[2])
"""
"""The script of `BrokerClient.renew_lease`: the keys of lease and signal; lease, its time. It returns the signal."""

T = TypeVar("T")


class BrokerClient:
    """A worker's client of the broker, which is Redis."""

    def __init__(
        self, redis_url: str, worker: str, instance: str | None = None, *, seals: Seals, timeout_s: float = TIMEOUT_S
    ) -> None:
        self._seals = seals
        self.worker = worker
        self.instance = instance
        self._redis = Redis.from_url(
            redis_url,
            socket_timeout=timeout_s,
            socket_connect_timeout=timeout_s,
            # The first try finds a connection that the broker has closed, the second one makes a new one.
            retry=Retry(ExponentialBackoff(cap=0.5, base=0.05), 1),
        )
        self._claim = self._redis.register_script(_CLAIM)
        self._renew = self._redis.register_script(_RENEW)

    def claim(self, order: Order, lease: str) -> bool:
        """Acquire the lease of an attempt and publish that it is claimed, in one exchange.

        Return False, and publish nothing, if the service has requested a stop, or if another delivery of the order
        holds the lease. A stop signal or a lease that is not signed is counted and does not hinder.

        Parameters
        ----------
        order
            The order of the attempt.
        lease
            A `new_lease`, the same for every try of one delivery: the answer to an earlier try may have been lost.
        """
        keys = (wire.stop_key(order.attempt), wire.lease_key(order.attempt), wire.EVENTS_STREAM)
        claimed = self._seals.sealed_event(event_of(order, EventKind.CLAIMED, self))
        refused = {b"stop": b"", b"lease": b""}
        for _ in range(MOST_TRIES):
            found = self._claim(
                keys=keys, args=(lease, _ms(wire.LEASE_TTL_S), wire.EVENTS_KEPT, claimed, *refused.values())
            )
            if not found:
                return True
            kind, text = found
            if self._is_stop(order.attempt, text) if kind == b"stop" else self._is_lease(order.attempt, text):
                return False
            refused[kind] = text
        return False

    def renew_lease(self, attempt: str) -> bool:
        """Renew the lease of an attempt for another `LEASE_TTL_S`; return whether the attempt is requested to stop."""
        keys = (wire.lease_key(attempt), wire.stop_key(attempt))
        stop = self._renew(keys=keys, args=(self.new_lease(attempt), _ms(wire.LEASE_TTL_S)))
        return stop is not None and self._is_stop(attempt, stop)

    def new_lease(self, attempt: str) -> str:
        """Return the text of a lease of this worker from now on."""
        lease = Lease(attempt=attempt, worker=self.worker, instance=self.instance, at_s=time.time())
        return self._seals.sealed_lease(lease)

    def _is_stop(self, attempt: str, text: bytes) -> bool:
        return _is_accepted(lambda: self._seals.check_stop(text, attempt=attempt))

    def _is_lease(self, attempt: str, text: bytes) -> bool:
        return _is_accepted(lambda: self._seals.open_lease(text, attempt=attempt))

    def publish(self, event: Event) -> None:
        """Publish an event on the stream."""
        self._add(self._redis, event)

    def publish_final(self, event: Event) -> None:
        """Publish the final event of an attempt and release its lease, in one exchange."""
        pipe = self._redis.pipeline(transaction=False)
        self._add(pipe, event)
        pipe.delete(wire.lease_key(event.attempt))
        pipe.execute()

    def _add(self, redis: Redis, event: Event) -> None:
        text = self._seals.sealed_event(event)
        redis.xadd(wire.EVENTS_STREAM, {"event": text}, maxlen=wire.EVENTS_KEPT, approximate=True)

    def patiently(self, exchange: Callable[[], T], *, within_s: float, stopping: Callable[[], bool]) -> T:
        """Return the answer to an exchange, which is repeated while Redis is unreachable.

        Raises
        ------
        RedisError
            If Redis is unreachable for `within_s`, or for `STOPPING_S` after the worker began to stop.
        """
        until_s = time.monotonic() + within_s
        pause_s = 0.1
        while True:
            try:
                return exchange()
            except RedisError:
                if stopping():
                    until_s = min(until_s, time.monotonic() + STOPPING_S)
                if time.monotonic() + pause_s > until_s:
                    raise
                time.sleep(pause_s)
                pause_s = min(2 * pause_s, 1.0)

    def is_key_refused(self, key_id: str | None) -> bool:
        """Return whether the service says that it refuses a worker key, or workers without one."""
        name = key_refusal(key_id)
        found = self._redis.get(wire.stop_key(name))
        return isinstance(found, bytes) and self._is_stop(name, found)

    def directions(self) -> Directions | None:
        """Return the directions of the coordinator; None if there are none, or none that are signed."""
        text: Any = self._redis.get(wire.DIRECTIONS)
        try:
            return None if text is None else self._seals.open_directions(text)
        except Refused as error:
            refusals.record(error)
            return None

    def publish_presence(self, presence: Presence) -> None:
        """Publish that the worker is alive, for the next `PRESENCE_TTL_S`."""
        text = self._seals.sealed_presence(presence)
        self._redis.set(wire.presence_key(presence.name), text, px=_ms(wire.PRESENCE_TTL_S))

    def remove_presence(self) -> None:
        """Remove the worker's presence; it expires by itself if Redis is unreachable."""
        try:
            self._redis.delete(wire.presence_key(self.worker))
        except RedisError:
            return


class AttemptHeartbeat:
    """The heartbeat of an attempt: renews its lease, publishes its progress, and receives the stop request.

    It is a context manager and a `ProgressMonitor`. The working thread may set `progress` at any time. Work that for
    `hung_s` makes no progress and does not ask whether to stop cannot be ended by another thread (for example when a
    file system does not answer): then the process is killed, and the service notices that the heartbeat is missing.
    """

    def __init__(
        self,
        broker: BrokerClient,
        order: Order,
        *,
        worker_stopping: Callable[[], bool],
        hung_s: float,
        announce: Callable[[str], None] = lambda attempt: None,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.progress = 0.0
        self._hung_s = hung_s
        self._clock = clock
        self._asked = 0
        self._moved = ((self.progress, self._asked), clock())
        self._broker = broker
        self._order = order
        self._worker_stopping = worker_stopping
        self._announce = announce
        self._stop_seen = threading.Event()
        self._ended = threading.Event()
        self._beating = threading.Lock()
        self._next_heartbeat_s = 0.0

    def should_stop(self) -> bool:
        """Return whether the attempt should end now: the service or the shutdown of the worker requests it."""
        self._asked += 1
        return self._stop_seen.is_set() or self._worker_stopping()

    def announce_end(self) -> None:
        """Announce that the attempt will soon need its core no longer."""
        self._announce(self._order.attempt)

    def __enter__(self) -> Self:
        _thread.add(self)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        _thread.remove(self)
        self._ended.set()
        if self._beating.acquire(timeout=JOIN_S):
            self._beating.release()

    def beat(self) -> None:
        """Renew the lease, and publish the progress if it is due; do nothing after the end of the attempt."""
        with self._beating:
            if self._ended.is_set():
                return
            if self._is_hung():
                os.kill(os.getpid(), signal.SIGKILL)
            with contextlib.suppress(RedisError):  # the next beat tries again
                self._renew()

    def _renew(self) -> None:
        if self._broker.renew_lease(self._order.attempt):
            self._stop_seen.set()
        if time.monotonic() >= self._next_heartbeat_s:
            self._next_heartbeat_s = time.monotonic() + wire.HEARTBEAT_S
            self._broker.publish(event_of(self._order, EventKind.HEARTBEAT, self._broker, progress=self.progress))

    def _is_hung(self) -> bool:
        before, since_s = self._moved
        now = (self.progress, self._asked)
        if now != before:
            self._moved = (now, self._clock())
            return False
        return self._clock() - since_s > self._hung_s


class _HeartbeatThread:
    """The thread of a process that beats for all its attempts; it ends when it finds none, and starts with the next."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._attempts: set[AttemptHeartbeat] = set()
        self._thread: threading.Thread | None = None

    def add(self, attempt: AttemptHeartbeat) -> None:
        """Beat for an attempt from now on."""
        with self._lock:
            self._attempts.add(attempt)
            if self._thread is None or not self._thread.is_alive():  # a process that was forked has no thread yet
                self._thread = threading.Thread(target=self._run, name="heartbeat", daemon=True)
                self._thread.start()

    def remove(self, attempt: AttemptHeartbeat) -> None:
        """Beat no longer for an attempt."""
        with self._lock:
            self._attempts.discard(attempt)

    def _run(self) -> None:
        while True:
            time.sleep(wire.STOP_POLL_S)
            with self._lock:
                attempts = list(self._attempts)
                if not attempts:
                    self._thread = None
                    return
            for attempt in attempts:
                attempt.beat()


_thread = _HeartbeatThread()


def event_of(
    order: Order,
    kind: EventKind,
    broker: BrokerClient,
    *,
    progress: float | None = None,
    cpu_s: float | None = None,
    wall_s: float | None = None,
    failure: Failure | None = None,
    probe: ProbeResult | None = None,
    digests: Mapping[str, Digest] | None = None,
    cached: bool = False,
) -> Event:
    """Return an event about the attempt of an order, from the worker of a broker client, with the time of now."""
    return Event(
        kind=kind,
        job_id=order.job_id,
        task_id=order.task_id,
        attempt=order.attempt,
        worker=broker.worker,
        instance=broker.instance,
        at_s=time.time(),
        progress=progress,
        cpu_s=cpu_s,
        wall_s=wall_s,
        failure=failure,
        probe=probe,
        digests=dict(digests or {}),
        cached=cached,
    )


def _is_accepted(open_message: Callable[[], object]) -> bool:
    try:
        open_message()
    except Refused as error:
        refusals.record(error)
        return False
    return True


def _ms(seconds: float) -> int:
    return round(seconds * 1000)
