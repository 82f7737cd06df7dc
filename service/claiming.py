"""Which workers take orders. A worker that is online and takes none is named, and its slots do not count.

The broker gives a waiting order to any worker that polls, at once. So a worker with a free slot takes no orders if the
same order has been first in the queue for a while and the worker has taken nothing in that time.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set

from lippmann.job.messages.events import Presence

SILENT_S = 20.0
"""The time without an answered poll after which a worker does not take orders, by its own account."""


def declining_workers(workers: Sequence[Presence], avoided: Set[str]) -> tuple[str, ...]:
    """Return the workers that decline an order: those at fault, and those avoided unless no other would be left."""
    at_fault = {worker.name for worker in workers if worker.fault is not None}
    is_left = any(worker.name not in avoided | at_fault for worker in workers)
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
        silent = {worker.name: self._silent_s(worker, unmoved_s) for worker in workers}
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
