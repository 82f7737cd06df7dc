"""A worker takes orders of the queues that it fits, unless it is drained, outside its hours or of another version."""

from __future__ import annotations

import time
from typing import Any

import pytest
from structlog.testing import capture_logs

from lippmann.job.messages.events import Closed, Directions, Presence
from lippmann.job.messages.protocol import OLDEST_PROTOCOL, PROTOCOL
from lippmann.job.messages.wire import QUEUE, queue_of
from lippmann.job.rendering.workers import JobRequirement, WorkerRequirement
from tests.builders_service import presence
from worker.duty import SETTLED_TICKS, Duty, first_queue
from worker.hours import parse_hours


def profile(**changes: Any) -> Presence:
    return presence().model_copy(
        update={"instance": "i1", "version": "1.0", "protocol": PROTOCOL, "oldest_protocol": OLDEST_PROTOCOL, **changes}
    )


def directions(**changes: Any) -> Directions:
    given = {"release": "1.0", "protocol": PROTOCOL, "oldest_protocol": OLDEST_PROTOCOL, **changes}
    return Directions.model_validate(given)


def reason(duty: Duty) -> Closed | None:
    return duty.closed


GPU, BIG, NIGHT, MITSUBA, NOTHING, NIGHT_NOTHING = (
    need.text
    for need in (
        WorkerRequirement(tags=("gpu",)),
        WorkerRequirement(tags=("gpu",), memory_mb=64_000),
        WorkerRequirement(pool="night"),
        JobRequirement(engine="mitsuba"),
        JobRequirement(engine="none"),
        JobRequirement(pool="night", engine="none"),
    )
)


@pytest.mark.parametrize(
    ("changes", "queues"),
    [
        ({}, {QUEUE}),
        ({"tags": ("gpu", "fast")}, {QUEUE, queue_of(GPU)}),
        ({"tags": ("gpu",), "memory_mb": 64_000}, {QUEUE, queue_of(GPU), queue_of(BIG)}),
        ({"pool": "night", "tags": ("gpu",)}, {queue_of(NIGHT), queue_of(NIGHT_NOTHING)}),
        ({"engines": ("povray", "mitsuba")}, {QUEUE, queue_of(MITSUBA), queue_of(NOTHING)}),
        ({"engines": ("mitsuba",), "povray": "none"}, {queue_of(MITSUBA), queue_of(NOTHING)}),
        ({"engines": (), "povray": "none", "pool": "night"}, {queue_of(NIGHT_NOTHING)}),
    ],
)
def test_a_worker_takes_orders_of_its_pool_and_of_the_requirements_that_it_meets(
    changes: dict[str, Any], queues: set[str]
) -> None:
    worker = profile(**changes)
    duty = Duty(worker)
    assert duty.queues == {first_queue(worker.pool, has_povray=worker.has_povray)}
    asked = (GPU, BIG, NIGHT, MITSUBA, NIGHT_NOTHING, '{"of a later release": 1}')
    duty.follow(directions(requirements=(*asked, NOTHING) if "engines" in changes else asked))
    assert duty.queues == queues


def test_a_drained_worker_takes_nothing_until_the_service_lets_it() -> None:
    duty = Duty(profile())
    duty.follow(directions(drains={"i1": False, "another": True}))
    assert reason(duty) is Closed.DRAINING
    assert not any(duty.may_end(held=0) for _ in range(2 * SETTLED_TICKS)), "it shall not end"
    duty.follow(directions())
    assert reason(duty) is None
    duty.follow(directions(drains={"another": True}))
    assert reason(duty) is None


def test_a_worker_that_shall_end_finishes_its_attempts_first() -> None:
    duty = Duty(profile())
    duty.follow(directions(drains={"i1": True}))
    held = [1] * 5 + [0] * (SETTLED_TICKS - 1)
    assert not any(duty.may_end(held=count) for count in held)
    assert not duty.may_end(held=1), "an order of the poll that had begun before the drain"
    assert [duty.may_end(held=0) for _ in range(SETTLED_TICKS)] == [*[False] * (SETTLED_TICKS - 1), True]


def test_a_drain_by_a_signal_ends_in_time_whatever_still_runs() -> None:
    now_s = [0.0]
    duty = Duty(profile(), steady=lambda: now_s[0])
    duty.drain(ends=True, within_s=60.0)
    duty.follow(directions())
    assert reason(duty) is Closed.DRAINING
    now_s[0] = 59.0
    assert not duty.may_end(held=1)
    now_s[0] = 60.0
    assert duty.may_end(held=1)


def test_a_drain_by_a_signal_holds_at_once_and_is_logged_later_since_its_handler_may_interrupt_the_log() -> None:
    duty = Duty(profile())
    with capture_logs() as logs:
        duty.drain(ends=True)
        assert (reason(duty), logs) == (Closed.DRAINING, [])
        duty.refresh()
        duty.refresh()
    assert [(entry["event"], entry["reason"]) for entry in logs] == [("takes no orders", Closed.DRAINING)]


def test_a_worker_outside_its_hours_says_when_they_begin() -> None:
    now_s = [time.mktime((2026, 11, 30, 18, 0, 0, 0, 0, -1))]
    duty = Duty(profile(), parse_hours("19:00-20:00"), clock=lambda: now_s[0])
    assert (duty.closed, duty.opens_s) == (Closed.HOURS, now_s[0] + 3600)
    now_s[0] += 3600
    duty.refresh()
    assert (duty.closed, duty.opens_s) == (None, None)
    now_s[0] += 3600
    duty.refresh()
    assert (duty.closed, duty.opens_s) == (Closed.HOURS, now_s[0] + 23 * 3600)


def test_a_worker_of_another_version_takes_nothing_if_messages_mean_something_else_and_its_log_says_so() -> None:
    duty = Duty(profile(version="0.0.9"))
    with capture_logs() as logs:
        duty.follow(directions(release="0.1.0"))
        duty.follow(directions(release="0.1.0"))
    assert reason(duty) is None
    (line,) = (entry["event"] for entry in logs)
    assert line == "this worker runs Lippmann 0.0.9, the service 0.1.0: upgrade the older one"
    with capture_logs() as logs:
        duty.follow(directions(release="9.0.0", protocol=PROTOCOL + 2, oldest_protocol=PROTOCOL + 1))
    assert reason(duty) is Closed.VERSION
    assert any(
        entry["log_level"] == "error" and f"the service 9.0.0 (messages {PROTOCOL + 2})" in entry["event"]
        for entry in logs
    )
