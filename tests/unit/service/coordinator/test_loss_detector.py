"""What is known of a worker ends its attempts; what is only not known does not."""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace

import pytest

from lippmann.job.messages import wire
from lippmann.job.messages.events import Lease, Presence
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import TaskStatus
from service.coordinator.loss_detector import CONFIRM_S, ROUNDS, LossDetector, Sighting, without_voucher
from service.db.task_state import HeldAttempt
from tests.builders_service import T0, presence

SILENCE_S = 45.0
RUNNING = HeldAttempt(
    job_id="j", sequence=1, kind=TaskKind.RENDER, status=TaskStatus.RUNNING, attempt="a", worker="w1", instance="i1",
    artifact="x", dispatched_s=T0, dispatched_idle_s=0.0, heartbeat_s=T0,
)  # fmt: skip
ORDER = replace(RUNNING, status=TaskStatus.DISPATCHED, worker=None, instance=None, heartbeat_s=None)


def worker(name: str = "w1", *, instance: str | None = "i1", seen_s: float = T0, holds: object = ()) -> Presence:
    return presence(name).model_copy(update={"instance": instance, "seen_s": seen_s, "holds": holds})


def lease(at_s: float, instance: str = "i1") -> Lease:
    return Lease(worker="w1", instance=instance, at_s=at_s)


@dataclass
class Watch:
    """A detector, and one broker whose answers the test sets."""

    held: list[HeldAttempt]
    workers: list[Presence] = field(default_factory=list)
    leases: dict[str, Lease] = field(default_factory=dict)
    first_order: str | None = None
    live_s: float = 0.0
    rounds: int = 0
    detector: LossDetector = field(default_factory=lambda: LossDetector(silence_s=SILENCE_S))

    def look(self, *, after_s: float = 0.0, rounds: int = ROUNDS) -> dict[str, str]:
        self.live_s += after_s
        self.rounds += rounds
        by_name = {one.name: one for one in self.workers}
        leases = {attempt: self.leases.get(attempt) for attempt in without_voucher(self.held, by_name)}
        seen = Sighting(
            live_s=self.live_s, rounds=self.rounds, workers=by_name, leases=leases, first_orders={"": self.first_order}
        )
        return self.detector.observe(self.held, seen)

    def looks(self, seconds: int) -> dict[str, str]:
        return [self.look(after_s=1.0) for _ in range(seconds)][-1]


def test_the_attempts_of_a_restarted_worker_are_lost_as_soon_as_its_last_events_are_read() -> None:
    watch = Watch([RUNNING], [worker(instance="i2")])
    assert watch.look(rounds=0) == {}
    assert watch.look(rounds=ROUNDS - 1) == {}, "its last event may still be unread"
    assert watch.look(rounds=1) == {"a": "worker w1 was restarted"}


def test_a_restart_is_believed_while_the_old_lease_runs_out_but_not_while_it_is_renewed() -> None:
    watch = Watch([RUNNING], [worker(instance="i2", seen_s=T0 + 4)], {"a": lease(T0)})
    watch.look()
    assert watch.look() == {"a": "worker w1 was restarted"}
    twin = Watch([RUNNING], [worker(instance="i2", seen_s=T0 + 4)], {"a": lease(T0 + 3.5)})
    assert twin.looks(60 - 16) == {}, "two workers have one name"


def test_a_worker_that_is_gone_with_its_lease_is_lost_once_that_lasts() -> None:
    watch = Watch([RUNNING])
    assert watch.looks(int(CONFIRM_S)) == {}
    assert watch.looks(1) == {"a": "worker w1 is gone"}


def test_while_the_clock_of_liveness_stands_still_nothing_is_confirmed() -> None:
    watch = Watch([RUNNING])
    assert [watch.look() for _ in range(100)] == [{}] * 100


def test_a_lease_is_a_sign_though_the_presence_is_missing() -> None:
    watch = Watch([RUNNING], leases={"a": lease(T0)})
    assert watch.looks(44) == {}


def test_an_attempt_that_its_worker_no_longer_holds_is_lost_once_that_lasts() -> None:
    watch = Watch([RUNNING], [worker(seen_s=T0 + 5)])
    assert watch.looks(int(CONFIRM_S)) == {}
    assert watch.looks(1) == {"a": "worker w1 no longer holds the attempt"}


def test_a_suspicion_that_was_wrong_begins_anew() -> None:
    watch = Watch([RUNNING])
    watch.looks(5)
    watch.leases["a"] = lease(T0)
    assert watch.look() == {}
    del watch.leases["a"]
    assert watch.looks(5) == {}


@pytest.mark.parametrize(
    "changes",
    [
        {"workers": [worker(holds=("a",))]},
        {"workers": [worker(holds=None)]},
        {"workers": [worker(instance="i2")], "held": [replace(RUNNING, instance=None)]},
        {"held": [replace(RUNNING, instance=None)]},
    ],
    ids=["vouched for", "worker without list", "older worker", "older worker gone"],
)
def test_what_nothing_is_known_of_is_lost_by_silence_alone(changes: dict[str, object]) -> None:
    watch = replace(Watch([RUNNING]), **changes)  # type: ignore[arg-type]
    assert watch.looks(46) == {}
    assert watch.looks(1) == {"a": "worker w1 went silent"}


def test_a_heartbeat_ends_the_silence() -> None:
    watch = Watch([RUNNING], [worker(holds=("a",))])
    for number in range(5):
        watch.held = [replace(RUNNING, heartbeat_s=T0 + number)]
        assert watch.looks(45) == {}


def test_an_order_that_is_nowhere_is_lost_once_that_lasts() -> None:
    watch = Watch([ORDER], [worker(), worker("w2")])
    assert watch.looks(int(CONFIRM_S)) == {}
    assert watch.looks(1) == {"a": "the order is neither in the queue nor with a worker"}


def test_an_order_that_was_sent_before_the_first_of_the_queue_has_left_it() -> None:
    later = replace(ORDER, attempt="b", dispatched_s=T0 + 1)
    watch = Watch([ORDER, later], [worker()], first_order="b")
    assert watch.looks(6) == {"a": "the order is neither in the queue nor with a worker"}


@pytest.mark.parametrize(
    "changes",
    [
        {"first_order": "a"},
        {"first_order": "of a cancelled job"},
        {"workers": [worker(), worker("w2", holds=("a",))]},
        {"workers": [worker(), worker("w2", holds=None)]},
        {"leases": {"a": lease(T0)}},
    ],
    ids=["in the queue", "unknown order first", "with a worker", "worker without list", "begun"],
)
def test_an_order_that_may_be_somewhere_is_kept(changes: dict[str, object]) -> None:
    watch = replace(Watch([ORDER], [worker()]), **changes)  # type: ignore[arg-type]
    assert watch.looks(100) == {}


@pytest.mark.parametrize("seed", range(20))
def test_a_living_worker_loses_nothing_in_any_order_of_outages_and_wipes(seed: int) -> None:
    chance = random.Random(seed)
    watch = Watch([RUNNING], [worker(holds=("a",))])
    settling = 0
    for second in range(2000):
        now_s = T0 + second
        settling -= 1
        if (
            chance.random() < 0.03
        ):  # an outage that outlasts all keys, or a wipe; the clock stands still until all is well
            watch.workers, watch.leases, settling = [], {}, 10
        if settling < chance.randrange(10):
            watch.workers = [worker(holds=("a",), seen_s=now_s)]
            watch.leases = {"a": lease(now_s)}
            watch.held = [replace(RUNNING, heartbeat_s=now_s)]
        assert watch.look(after_s=0.0 if settling > 0 else 1.0) == {}


@pytest.mark.parametrize("seed", range(20))
def test_a_dead_worker_is_lost_in_any_order_of_outages_and_returns(seed: int) -> None:
    chance = random.Random(seed)
    watch = Watch([RUNNING], [worker(holds=("a",))], {"a": lease(T0)})
    limit_s = wire.LEASE_TTL_S + CONFIRM_S + 2
    for _ in range(1000):
        if chance.random() < 0.2:
            watch.workers = [worker(instance="i2", seen_s=T0 + watch.live_s)] if chance.random() < 0.5 else []
        if watch.live_s >= wire.LEASE_TTL_S:
            watch.workers = [one for one in watch.workers if one.instance == "i2"]
            watch.leases = {}
        if watch.look(after_s=float(chance.random() < 0.5)):
            break
    assert watch.live_s <= limit_s
