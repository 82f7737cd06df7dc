"""A worker that takes no orders is known by the order that nobody takes."""

from __future__ import annotations

from lippmann.job.messages.events import Presence
from service.claiming import SILENT_S, ClaimWatch, declining_workers
from tests.builders_service import T0, presence

AFTER_S = 15.0


def idle(name: str = "w1", *, order_s: float | None = None, seen_s: float = T0) -> Presence:
    return presence(name).model_copy(update={"holds": (), "order_s": order_s, "seen_s": seen_s})


def watch() -> ClaimWatch:
    return ClaimWatch(unmoved_s=AFTER_S)


def test_a_worker_with_a_free_slot_takes_no_orders_if_the_first_order_waits() -> None:
    watching = watch()
    assert watching.observe([idle()], b"a", now_s=T0) == {}
    assert watching.observe([idle()], b"a", now_s=T0 + AFTER_S - 1) == {}
    assert watching.observe([idle()], b"a", now_s=T0 + AFTER_S) == {"w1": T0}


def test_a_queue_that_moves_or_is_empty_shows_nothing() -> None:
    watching = watch()
    for second, first in enumerate([b"a", b"b", None, b"b", b"c"]):
        assert watching.observe([idle()], first, now_s=T0 + second * (AFTER_S - 1)) == {}


def test_a_worker_without_a_free_slot_may_leave_orders_in_the_queue() -> None:
    busy = idle().model_copy(update={"holds": ("a1", "a2")})
    watching = watch()
    watching.observe([busy], b"a", now_s=T0)
    assert watching.observe([busy], b"a", now_s=T0 + 10 * AFTER_S) == {}


def test_a_worker_that_has_taken_an_order_meanwhile_is_not_named_whatever_its_clock_says() -> None:
    watching = watch()
    taking = idle("taking", seen_s=T0 - 5000.0, order_s=T0 - 5001.0)
    deaf = idle("deaf", seen_s=T0 + 5000.0, order_s=T0 + 4000.0)
    watching.observe([taking, deaf], b"a", now_s=T0)
    assert watching.observe([taking, deaf], b"a", now_s=T0 + AFTER_S) == {"deaf": T0}


def test_an_outage_of_the_broker_is_no_fault_of_the_workers() -> None:
    watching = watch()
    watching.observe([idle()], b"a", now_s=T0)
    watching.reset()
    assert watching.observe([idle()], b"a", now_s=T0 + 10 * AFTER_S) == {}


def test_a_worker_that_says_so_itself_takes_no_orders() -> None:
    silent = idle().model_copy(update={"consuming_s": T0 - SILENT_S - 1})
    assert watch().observe([silent, idle("w2")], None, now_s=T0) == {"w1": T0 - SILENT_S - 1}


def test_a_worker_of_an_older_version_is_trusted() -> None:
    watching = watch()
    watching.observe([presence()], b"a", now_s=T0)
    assert watching.observe([presence()], b"a", now_s=T0 + 10 * AFTER_S) == {}


def test_a_worker_that_takes_no_orders_is_no_other_one_for_a_task_that_failed() -> None:
    closed = [presence("b").model_copy(update={"closed": reason}) for reason in ("draining", "hours")]
    for worker in closed:
        assert declining_workers([presence("a"), worker], {"a"}) == (), "else nobody ever does the task"
    assert declining_workers([presence("a"), presence("b"), *closed], {"a"}) == ("a",)
