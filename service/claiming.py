"""Which workers take orders. A worker that is online and takes none is named, and its slots do not count.

The broker gives a waiting order to any worker that polls, at once. So a worker with a free slot takes no orders if the
same order has been first in the queue for a while and the worker has taken nothing in that time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence, Set

from lippmann.job.messages.events import Presence
from lippmann.job.rendering.workers import JobRequirement

SILENT_S = 20.0
"""The time without an answered poll after which a worker does not take orders, by its own account."""


def takes_orders(worker: Presence) -> bool:
    """Return whether a worker takes orders by its own account, and understands them."""
    return worker.closed is None and worker.understands()


def is_able(worker: Presence) -> bool:
    """Return whether a worker takes orders and can do them."""
    return worker.fault is None and takes_orders(worker)


def fitting(workers: Iterable[Presence], requirement: str) -> tuple[Presence, ...]:
    """Return the workers that meet the requirement of a job, given as `JobRequirement.text`."""
    needed = JobRequirement.of(requirement)
    return tuple(worker for worker in workers if not worker.lacks(needed))


def not_able(workers: Iterable[Presence]) -> tuple[str, ...]:
    """Return the names of the workers whose slots do not count, in order."""
    return tuple(sorted(worker.name for worker in workers if not is_able(worker)))


def counted(workers: Sequence[Presence], held: Mapping[str, int], not_counted: Mapping[str, int]) -> dict[str, int]:
    """Return the number of outstanding orders that are or will be in slots that count, by requirement.

    Orders of a requirement that no able worker meets are none of them.

    Parameters
    ----------
    held
        The number of outstanding orders, by requirement.
    not_counted
        The number of those that run on workers whose slots do not count.
    """
    served = (text for text in held if any(map(is_able, fitting(workers, text))))
    return {text: max(held[text] - not_counted.get(text, 0), 0) for text in served}


def rooms(
    workers: Sequence[Presence], held: Mapping[str, int], requirements: Iterable[str], *, per_slot: int, ahead: int = 0
) -> dict[str, int]:
    """Return how many further orders there is room for, by the requirement of their jobs; it may be negative.

    Parameters
    ----------
    held
        The number of outstanding orders in slots that count, by requirement; see `counted`.
    per_slot
        The number of orders for each slot of the workers that fit.
    ahead
        The number of outstanding orders for which there is room even if it is more than that.
    """
    found = {}
    for requirement in requirements:
        slots = sum(worker.slots for worker in fitting(workers, requirement) if is_able(worker))
        found[requirement] = max(per_slot * slots, ahead) - held.get(requirement, 0) if slots else 0
    return found


def declining_workers(workers: Sequence[Presence], avoided: Set[str]) -> tuple[str, ...]:
    """Return the workers that decline an order: those at fault, those that do not understand it, and those avoided.

    If no other worker that takes orders would be left, none is avoided.
    """
    at_fault = {worker.name for worker in workers if worker.fault is not None or not worker.understands()}
    is_left = any(takes_orders(worker) and worker.name not in avoided | at_fault for worker in workers)
    return tuple(sorted(avoided | at_fault if is_left else at_fault))


class ClaimWatch:
    """Watches the order that is first in the queue.

    Parameters
    ----------
    unmoved_s
        The time after which an order that is still first shows that somebody does not take orders.
    """

    def __init__(self, *, unmoved_s: float) -> None:
        self._unmoved_s = unmoved_s
        self._first: bytes | None = None
        self._since_s = 0.0

    def reset(self) -> None:
        """Forget the order: the broker is unreachable, so nobody can take it."""
        self._first = None

    def observe(self, workers: Sequence[Presence], first: bytes | None, *, now_s: float) -> Mapping[str, float]:
        """Return the workers that do not take orders, with the time since when.

        Parameters
        ----------
        workers
            The workers that are online.
        first
            The order that is first in the queue; None if the queue is empty.
        now_s
            The time in seconds since 1970; it may be set.
        """
        if first is None or first != self._first or now_s < self._since_s:
            self._first, self._since_s = first, now_s
        unmoved_s = 0.0 if first is None else now_s - self._since_s
        silent = {worker.name: self._silent_s(worker, unmoved_s) for worker in workers if takes_orders(worker)}
        return {name: now_s - seconds for name, seconds in silent.items() if seconds is not None}

    def _silent_s(self, worker: Presence, unmoved_s: float) -> float | None:
        """Return for how long a worker has not taken orders; None if nothing shows that it does not."""
        # Both times are of the worker's clock, so it need not agree with the clock of the service.
        polled_s = 0.0 if worker.consuming_s is None else worker.seen_s - worker.consuming_s
        if polled_s > SILENT_S:
            return polled_s
        if unmoved_s < self._unmoved_s or worker.holds is None or len(worker.holds) >= worker.slots:
            return None
        has_taken = worker.order_s is not None and worker.seen_s - worker.order_s < unmoved_s
        return None if has_taken else unmoved_s


class ClaimWatches:
    """A `ClaimWatch` for each queue, of the workers that take its orders."""

    def __init__(self, *, unmoved_s: float) -> None:
        self._unmoved_s = unmoved_s
        self._watches: dict[str, ClaimWatch] = {}

    def reset(self) -> None:
        """Forget all orders: the broker is unreachable, so nobody can take them."""
        self._watches.clear()

    def observe(
        self, workers: Sequence[Presence], first_orders: Mapping[str, bytes | None], *, now_s: float
    ) -> Mapping[str, float]:
        """Return the workers that do not take orders, with the time since when.

        Parameters
        ----------
        first_orders
            The order that is first in each queue, by the requirement of its jobs; None if the queue is empty.
        """
        self._watches = {
            text: self._watches.get(text) or ClaimWatch(unmoved_s=self._unmoved_s) for text in first_orders
        }
        found: dict[str, float] = {}
        for text, first in first_orders.items():
            found |= self._watches[text].observe(fitting(workers, text), first, now_s=now_s)
        return found
