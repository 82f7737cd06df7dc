"""The directions of the coordinator to all workers: the queues that there are, and which workers are drained.

A worker reads them every second (`worker.duty`). Orders of jobs with a requirement may wait in their queue before any
worker has read that it exists.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from contextlib import suppress

from lippmann.job.messages import wire
from lippmann.job.messages.events import Directions, Presence
from lippmann.job.messages.protocol import OLDEST_PROTOCOL, PROTOCOL
from service.broker_stream import Stream
from service.db import drains as drain_rows
from service.db import jobs as job_rows
from service.db.engine import Database
from service.errors import BrokerUnavailable

KEPT_DRAIN_S = 86_400.0
"""The time for which the drain of a worker process that is not online is kept."""
LOOKS = 3600
"""The number of runs, one a second or more while the broker answers, in none of which such a process was online."""


class DirectionsPublisher:
    """Publishes the directions when they change, and every few seconds. Any thread may call it.

    Parameters
    ----------
    release
        The version of Lippmann.
    steady
        A clock that is never set, in seconds.
    """

    def __init__(self, database: Database, stream: Stream, *, release: str, steady: Callable[[], float]) -> None:
        self._database = database
        self._stream = stream
        self._release = release
        self._steady = steady
        self._published: Directions | None = None
        self._next_s = float("-inf")
        self._lock = threading.Lock()
        self._looks = 0
        self._online: set[str | None] = set()

    @property
    def requirements(self) -> tuple[str, ...]:
        """The requirements of the open jobs, with the empty one first, as they were published last."""
        return ("", *(self._published.requirements if self._published is not None else ()))

    def run(self, workers: Sequence[Presence], *, now_s: float) -> None:
        """Publish the directions if it is time; the queues of requirements that no job has any more are deleted.

        Old drains of worker processes that have gone are forgotten.

        Parameters
        ----------
        workers
            The workers that are online.

        Raises
        ------
        BrokerUnavailable
            If the broker does not answer.
        """
        with self._lock:
            self._forget_drains(workers, now_s)
            self._run(workers)

    def _run(self, workers: Sequence[Presence]) -> None:
        with self._database.reading() as session:
            excluded = {row.worker for row in drain_rows.exclusions(session)}
            starts = (worker.instance for worker in workers if worker.name in excluded)
            directions = Directions(
                requirements=tuple(job_rows.requirements(session)),
                drains={instance: False for instance in starts if instance} | drain_rows.drains(session),
                release=self._release,
                protocol=PROTOCOL,
                oldest_protocol=OLDEST_PROTOCOL,
            )
        if directions == self._published and self._steady() < self._next_s:
            return
        gone = set(self.requirements) - {"", *directions.requirements}
        self._stream.publish_directions(directions)
        self._published = directions
        self._next_s = self._steady() + wire.DIRECTIONS_S
        with suppress(BrokerUnavailable):  # what is left there is refused by the workers, as of attempts that are over
            for requirement in gone:
                self._stream.delete_queue(requirement)

    def _forget_drains(self, workers: Sequence[Presence], now_s: float) -> None:
        self._online |= {worker.instance for worker in workers}
        self._looks += 1
        if self._looks < LOOKS:
            return
        online, self._online, self._looks = self._online, set(), 0
        with self._database.reading() as session:
            gone = drain_rows.drained_before(session, now_s - KEPT_DRAIN_S) - online
        if gone:
            with self._database.writing() as session:
                drain_rows.delete_drains(session, gone)
