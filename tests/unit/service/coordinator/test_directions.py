"""The directions are published by one thread at a time."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import cast

from lippmann.job.messages.events import Directions
from service.broker_stream import Stream
from service.coordinator.directions import DirectionsPublisher
from tests.builders_service import Farm


class Meeting:
    """A stream on which two threads that publish at the same time meet."""

    def __init__(self) -> None:
        self.published: list[Directions] = []
        self._both = threading.Barrier(2, timeout=1)

    def publish_directions(self, directions: Directions) -> None:
        self.published.append(directions)
        with suppress(threading.BrokenBarrierError):
            self._both.wait()


def test_what_two_threads_publish_at_the_same_time_is_published_once(farm: Farm) -> None:
    stream = Meeting()
    publisher = DirectionsPublisher(farm.database, cast(Stream, stream), release="1.0", steady=lambda: 0.0)
    with ThreadPoolExecutor() as threads:
        for done in [threads.submit(publisher.run) for _ in range(2)]:
            done.result()
    assert len(stream.published) == 1
