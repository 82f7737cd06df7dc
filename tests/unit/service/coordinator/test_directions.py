"""The directions are published by one thread at a time, and drains of processes that have gone do not stay."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import cast

import pytest

from lippmann.job.messages.events import Directions, Presence
from service.broker_stream import Stream
from service.coordinator import directions
from service.coordinator.directions import KEPT_DRAIN_S, DirectionsPublisher
from service.db.drains import exclude, include, set_drain
from tests.builders_service import Farm, presence


class Meeting:
    """A stream on which two threads that publish at the same time meet."""

    def __init__(self) -> None:
        self.published: list[Directions] = []
        self._both = threading.Barrier(2, timeout=1)

    def publish_directions(self, published: Directions) -> None:
        self.published.append(published)
        with suppress(threading.BrokenBarrierError):
            self._both.wait()


def test_what_two_threads_publish_at_the_same_time_is_published_once(farm: Farm) -> None:
    stream = Meeting()
    publisher = DirectionsPublisher(farm.database, cast(Stream, stream), release="1.0", steady=lambda: 0.0)
    with ThreadPoolExecutor() as threads:
        for done in [threads.submit(publisher.run, (), now_s=0.0) for _ in range(2)]:
            done.result()
    assert len(stream.published) == 1


class Published:
    """Keeps the directions that were published last."""

    def __init__(self) -> None:
        self.last: Directions | None = None

    def publish_directions(self, published: Directions) -> None:
        self.last = published


def test_old_drains_of_processes_that_have_gone_are_forgotten(farm: Farm, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(directions, "LOOKS", 3)
    published = Published()
    publisher = DirectionsPublisher(farm.database, cast(Stream, published), release="1", steady=lambda: farm.now_s)
    with farm.writing() as session:
        for name in ("gone", "online", "away for a moment"):
            set_drain(session, name, f"of {name}", ends=False, now_s=farm.now_s)
        set_drain(session, "new", "of new", ends=True, now_s=farm.now_s + KEPT_DRAIN_S)
    farm.now_s += KEPT_DRAIN_S + 1
    online, away = (
        presence(name).model_copy(update={"instance": f"of {name}"}) for name in ("online", "away for a moment")
    )
    drained = []
    rounds: list[list[Presence]] = [[online, away], [online], []]
    for workers in rounds:
        publisher.run(workers, now_s=farm.now_s)
        assert published.last is not None
        drained.append(set(published.last.drains))
    kept = {"of online", "of away for a moment", "of new"}
    assert drained == [kept | {"of gone"}, kept | {"of gone"}, kept]


def test_every_start_of_an_excluded_worker_is_drained_until_the_worker_is_included(farm: Farm) -> None:
    published = Published()
    publisher = DirectionsPublisher(farm.database, cast(Stream, published), release="1", steady=lambda: farm.now_s)

    def drains(instance: str) -> dict[str, bool]:
        workers = [presence(name).model_copy(update={"instance": f"{instance} of {name}"}) for name in ("bad", "good")]
        publisher.run(workers, now_s=farm.now_s)
        assert published.last is not None
        return published.last.drains

    with farm.writing() as session:
        exclude(session, "bad", name="ann", now_s=farm.now_s)
    assert drains("first start") == {"first start of bad": False}
    assert drains("next start") == {"next start of bad": False}
    with farm.writing() as session:
        include(session, "bad")
    assert drains("next start") == {}
