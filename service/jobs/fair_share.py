"""Fair share: the job with the highest priority comes first, and among equals the one with the fewest orders. Pure."""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Claim:
    """A job with ready tasks."""

    job_id: str
    priority: int
    outstanding: int
    ready: int


def share_out(claims: Iterable[Claim], room: int) -> dict[str, int]:
    """Divide `room` orders between jobs.

    Examples
    --------
    >>> share_out([Claim("a", 50, 3, 9), Claim("b", 50, 0, 9)], 5)
    {'b': 4, 'a': 1}
    """
    heap = [(-claim.priority, claim.outstanding, claim.job_id, claim.ready) for claim in claims if claim.ready > 0]
    heapq.heapify(heap)
    given: Counter[str] = Counter()
    while heap and given.total() < room:
        priority, outstanding, job_id, ready = heapq.heappop(heap)
        given[job_id] += 1
        if ready > 1:
            heapq.heappush(heap, (priority, outstanding + 1, job_id, ready - 1))
    return dict(given)
