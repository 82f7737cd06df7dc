"""The loss detector: which attempts and orders are lost, by what the broker says about their workers. Pure.

A worker vouches for the attempts in its presence. An attempt for which nobody vouches is lost if its process no longer
renews its lease, and an order that is neither in the queue nor with a worker is lost too. In doubt, nothing is lost
until an attempt has been silent for so long that nothing else needs to be known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from lippmann.job.messages import wire
from lippmann.job.messages.events import Lease, Presence
from lippmann.job.messages.orders import requirement_of
from lippmann.job.states import TaskStatus
from service.db.task_state import HeldAttempt

STALE_S = 3 * wire.STOP_POLL_S
"""The time after which a lease shows that its process renews it no longer, if the worker has given a sign since."""
CONFIRM_S = 5.0
"""The time for which the absence of every sign must last, since signs need a moment to arrive."""
ROUNDS = 2
"""The number of complete readings of the event stream after which no event of before the sighting is unread."""


@dataclass(frozen=True)
class Sighting:
    """The knowledge of the broker at one moment."""

    live_s: float
    """The clock of `service.coordinator.liveness`, which stands still in every doubt."""
    rounds: int
    """The number of complete readings of the event stream."""
    workers: Mapping[str, Presence]
    """The workers that are online, by name."""
    leases: Mapping[str, Lease | None]
    """The leases of those attempts for which nobody vouches."""
    first_orders: Mapping[str, str | None]
    """The attempt whose order is first in each queue, by the requirement of its tasks; None if the queue is empty."""
    requirements: Mapping[str, str] = field(default_factory=dict)
    """The requirements of the jobs that have one, by job."""


@dataclass
class _Suspicion:
    live_s: float
    rounds: int


@dataclass
class LossDetector:
    """Remembers what was seen of each attempt.

    Parameters
    ----------
    silence_s
        The time without a heartbeat after which an attempt is lost, whatever else is known of it.
    """

    silence_s: float
    _heard: dict[str, tuple[float | None, float]] = field(default_factory=dict)
    """The last heartbeat of each running attempt, and the live time at which it was new."""
    _suspicions: dict[str, _Suspicion] = field(default_factory=dict)

    def observe(self, held: Sequence[HeldAttempt], seen: Sighting) -> dict[str, str]:
        """Return the reasons why attempts are lost, by attempt."""
        sent_s = {each.attempt: each.dispatched_s for each in held}
        heard, suspicions, lost = self._heard, self._suspicions, {}
        self._heard, self._suspicions = {}, {}
        for each in held:
            if each.status is TaskStatus.RUNNING:
                last = heard.get(each.attempt)
                is_new = last is None or last[0] != each.heartbeat_s
                self._heard[each.attempt] = (each.heartbeat_s, seen.live_s) if is_new or last is None else last
                reason, is_certain = _missing_attempt(each, seen)
            else:
                reason, is_certain = _missing_order(each, seen, sent_s), False
            if reason is not None:
                begun = suspicions.get(each.attempt, _Suspicion(seen.live_s, seen.rounds))
                self._suspicions[each.attempt] = begun
                is_confirmed = is_certain or seen.live_s - begun.live_s >= CONFIRM_S
                if is_confirmed and seen.rounds - begun.rounds >= ROUNDS:
                    lost[each.attempt] = reason
            elif self._is_silent(each, seen):
                lost[each.attempt] = f"worker {each.worker} went silent"
        return lost

    def _is_silent(self, each: HeldAttempt, seen: Sighting) -> bool:
        return each.attempt in self._heard and seen.live_s - self._heard[each.attempt][1] > self.silence_s


def without_voucher(held: Sequence[HeldAttempt], workers: Mapping[str, Presence]) -> list[str]:
    """Return the attempts whose leases must be read, since no worker says that it holds them."""
    holding = {(one.instance, attempt) for one in workers.values() for attempt in one.holds or ()}
    held_by_any = {attempt for _, attempt in holding}
    return [
        each.attempt
        for each in held
        if (each.attempt not in held_by_any if each.instance is None else (each.instance, each.attempt) not in holding)
    ]


def _missing_attempt(each: HeldAttempt, seen: Sighting) -> tuple[str | None, bool]:
    """Return why nothing shows that a running attempt lives, and whether this needs no confirmation."""
    worker = seen.workers.get(each.worker or "")
    lease = seen.leases.get(each.attempt)
    if each.instance is None:
        return None, False  # an older worker, of which only the silence is known
    if worker is None:
        return (f"worker {each.worker} is gone" if lease is None else None), False
    # Both times are of the clock of the worker's machine, so it need not agree with any other.
    is_renewed = lease is not None and worker.seen_s - lease.at_s <= STALE_S
    if is_renewed or (worker.instance == each.instance and _may_hold(worker, each.attempt)):
        return None, False
    if worker.instance == each.instance:
        return f"worker {each.worker} no longer holds the attempt", False
    return f"worker {each.worker} was restarted", True


def _missing_order(each: HeldAttempt, seen: Sighting, sent_s: Mapping[str, float | None]) -> str | None:
    """Return why an order that no worker has claimed is nowhere."""
    if seen.leases.get(each.attempt) is not None or any(_may_hold(one, each.attempt) for one in seen.workers.values()):
        return None
    requirement = requirement_of(seen.requirements.get(each.job_id, ""), each.kind)
    if requirement not in seen.first_orders:
        return None  # the queue is too new to have been looked at
    first_order = seen.first_orders[requirement]
    if first_order is not None:
        # The queue is first in, first out: what was sent before its first order has left it.
        first_s = sent_s.get(first_order)
        if first_s is None or (each.dispatched_s or 0.0) >= first_s:
            return None
    return "the order is neither in the queue nor with a worker"


def _may_hold(worker: Presence, attempt: str) -> bool:
    return worker.holds is None or attempt in worker.holds
