"""What a worker says and asks on Redis: leases, stop signs, events, presence.

Redis may be away or wiped at any moment. Then a lease is simply not held, a beat is missed and a last word comes late:
the service finds out by silence and by the artifact, and the work goes on meanwhile.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from redis import Redis
from redis.backoff import ExponentialBackoff
from redis.exceptions import RedisError
from redis.retry import Retry

from lippmann.job import wire
from lippmann.job.events import Event, EventKind, Failure, Presence, ProbeResult
from lippmann.job.orders import Order

LAST_WORD_S = 60.0
"""How long `done` and `failed` are tried to be said while Redis is away."""


class Wire:
    """A worker's side of Redis."""

    def __init__(self, redis_url: str, worker: str) -> None:
        self.worker = worker
        self._redis = Redis.from_url(
            redis_url,
            socket_timeout=5,
            socket_connect_timeout=5,
            retry=Retry(ExponentialBackoff(cap=0.5, base=0.05), 2),
        )

    def take_lease(self, attempt: str) -> bool:
        """Return whether this worker now has the attempt."""
        taken = self._redis.set(wire.lease_key(attempt), self.worker, nx=True, px=_ms(wire.LEASE_TTL_S))
        return bool(taken)

    def keep_lease(self, attempt: str) -> None:
        """Hold the attempt for another while."""
        self._redis.set(wire.lease_key(attempt), self.worker, px=_ms(wire.LEASE_TTL_S))

    def drop_lease(self, attempt: str) -> None:
        """Let the attempt go, if Redis listens; it runs out by itself otherwise."""
        try:
            self._redis.delete(wire.lease_key(attempt))
        except RedisError:
            return

    def told_to_stop(self, attempt: str) -> bool:
        """Return whether the service told the attempt to stop."""
        return bool(self._redis.exists(wire.stop_key(attempt)))

    def say(self, event: Event) -> None:
        """Put an event on the stream."""
        fields: dict[Any, Any] = {"event": event.model_dump_json(exclude_none=True)}
        self._redis.xadd(wire.EVENTS_STREAM, fields, maxlen=wire.EVENTS_KEPT, approximate=True)

    def say_at_last(self, event: Event, *, within_s: float = LAST_WORD_S) -> bool:
        """Put an event on the stream, trying for a while; return whether it got there."""
        until = time.monotonic() + within_s
        pause_s = 0.1
        while True:
            try:
                self.say(event)
            except RedisError:
                if time.monotonic() + pause_s > until:
                    return False
                time.sleep(pause_s)
                pause_s = min(2 * pause_s, 5.0)
            else:
                return True

    def be_present(self, presence: Presence) -> None:
        """Say that the worker is there."""
        self._redis.set(wire.presence_key(presence.name), presence.model_dump_json(), px=_ms(wire.PRESENCE_TTL_S))

    def leave(self) -> None:
        """Say that the worker is gone, if Redis listens."""
        try:
            self._redis.delete(wire.presence_key(self.worker))
        except RedisError:
            return


class Heart:
    """Beats while an attempt works: keeps its lease, tells its progress, hears the stop sign.

    A context manager. `progress` may be set from the working thread at any time. Work without progress for `hung_s`
    cannot be ended from beside it (a file system that does not answer): then the process is, and the service hears the
    silence.
    """

    def __init__(self, line: Wire, order: Order, *, worker_stopping: Callable[[], bool], hung_s: float) -> None:
        self.progress = 0.0
        self._hung_s = hung_s
        self._moved = (0.0, time.monotonic())
        self._line = line
        self._order = order
        self._worker_stopping = worker_stopping
        self._stop_seen = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="heart", daemon=True)

    def should_stop(self) -> bool:
        """Return whether the attempt should end now."""
        return self._stop_seen.is_set() or self._worker_stopping()

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()

    def _hangs(self) -> bool:
        progress, since_s = self._moved
        if self.progress != progress:
            self._moved = (self.progress, time.monotonic())
            return False
        return time.monotonic() - since_s > self._hung_s

    def _beat(self) -> None:
        next_beat = 0.0
        while not self._ended.wait(wire.STOP_POLL_S):
            if self._hangs():
                os.kill(os.getpid(), signal.SIGKILL)
            try:
                if self._line.told_to_stop(self._order.attempt):
                    self._stop_seen.set()
                if time.monotonic() >= next_beat:
                    next_beat = time.monotonic() + wire.BEAT_S
                    self._line.keep_lease(self._order.attempt)
                    self._line.say(event_of(self._order, EventKind.BEAT, self._line.worker, progress=self.progress))
            except RedisError:
                continue


class Announcer:
    """Says every few seconds that a worker is there, and touches its heartbeat file."""

    def __init__(self, line: Wire, presence: Presence, heartbeat_file: Path | None) -> None:
        self._line = line
        self._presence = presence
        self._heartbeat_file = heartbeat_file
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._announce, name="announcer", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """Say that the worker is gone."""
        self._ended.set()
        if self._thread.is_alive():
            self._thread.join()
        self._line.leave()

    def _announce(self) -> None:
        while not self._ended.is_set():
            if self._heartbeat_file:
                self._heartbeat_file.touch()
            # Without Redis nobody hears it; the next time somebody may.
            with contextlib.suppress(RedisError):
                self._line.be_present(self._presence.model_copy(update={"seen_s": time.time()}))
            self._ended.wait(wire.BEAT_S)


def event_of(
    order: Order,
    kind: EventKind,
    worker: str,
    *,
    progress: float | None = None,
    cpu_s: float | None = None,
    wall_s: float | None = None,
    failure: Failure | None = None,
    probe: ProbeResult | None = None,
) -> Event:
    """Return the event that something happened to an order's attempt, now."""
    return Event(
        kind=kind,
        job_id=order.job_id,
        task_id=order.task_id,
        attempt=order.attempt,
        worker=worker,
        at_s=time.time(),
        progress=progress,
        cpu_s=cpu_s,
        wall_s=wall_s,
        failure=failure,
        probe=probe,
    )


def _ms(seconds: float) -> int:
    return round(seconds * 1000)
