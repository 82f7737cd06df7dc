"""Fair share: the job with the highest priority comes first, and among equals the one with the fewest orders. Pure.

An owner whose jobs hold as many slots as the limit allows gets no further order, whatever the priority.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from lippmann.job.rendering.workers import without_engine


@dataclass(frozen=True)
class Claim:
    """A job with ready tasks, or with outstanding orders."""

    job_id: str
    priority: int
    outstanding: int
    ready: int
    owner_id: str = ""
    max_slots: int | None = None
    """The largest number of outstanding orders of all jobs of the owner with which this job gets its next one; None
    without a limit. An order holds its slot from the time at which it is sent."""
    requirement: str = ""
    """The requirement of the job, or of those of its tasks that this claim is for, as `JobRequirement.text`."""
    own_slots: int | None = None
    """The largest number of outstanding orders of the job itself; None without a limit."""
    renders: bool | None = None
    """True if this claim is for the tasks that need the engine of the job, False if it is for the others, None if it is
    for all. Of a part, `outstanding` and `own_slots` are of the whole job, and `ready` is the most it may have."""

    @property
    def key(self) -> str:
        """The job, and the part of its tasks.

        >>> Claim("a", 50, 0, 9).key, Claim("a", 50, 0, 9, renders=False).key
        ('a', 'a others')
        """
        return self.job_id if self.renders is None else f"{self.job_id} {'renders' if self.renders else 'others'}"

    def by_requirement(self) -> tuple[Claim, ...]:
        """Return a claim for each requirement of the tasks of a job, whose claim this is."""
        others = without_engine(self.requirement)
        if others == self.requirement:
            return (self,)
        return replace(self, renders=True), replace(self, renders=False, requirement=others)


def share_out(
    claims: Iterable[Claim],
    room: int,
    *,
    held: Mapping[str, int] = MappingProxyType({}),
    rooms: Mapping[str, int] | None = None,
) -> dict[str, int]:
    """Divide `room` orders between jobs; return the number of each claim, by its key.

    Parameters
    ----------
    held
        The number of outstanding orders of each owner, those of jobs without a claim included.
    rooms
        The number of orders that jobs with a requirement may get, by requirement, and none for one that is missing;
        None if only `room` limits them.

    Examples
    --------
    >>> share_out([Claim("a", 50, 3, 9), Claim("b", 50, 0, 9)], 5)
    {'b': 4, 'a': 1}
    >>> share_out([Claim("a", 90, 1, 9, "ann", max_slots=2), Claim("b", 50, 0, 9, "bob")], 5, held={"ann": 1})
    {'a': 1, 'b': 4}
    >>> share_out([Claim("a", 90, 1, 9, own_slots=3), Claim("b", 50, 0, 9, requirement="r")], 9, rooms={"": 9, "r": 1})
    {'a': 2, 'b': 1}
    """
    heap = [(-claim.priority, claim.outstanding, claim.key, claim.ready, claim) for claim in claims if claim.ready > 0]
    heapq.heapify(heap)
    given: Counter[str] = Counter()
    of_job: Counter[str] = Counter()
    holds = Counter(held)
    left = None if rooms is None else Counter(rooms)
    while heap and given.total() < room:
        priority, outstanding, key, ready, claim = heapq.heappop(heap)
        if (
            is_at_limit(claim, holds)
            or is_full(claim, claim.outstanding + of_job[claim.job_id])
            or (left is not None and left[claim.requirement] < 1)
        ):
            continue
        given[key] += 1
        of_job[claim.job_id] += 1
        if left is not None:
            left[claim.requirement] -= 1
        holds[claim.owner_id] += 1
        if ready > 1:
            heapq.heappush(heap, (priority, outstanding + 1, key, ready - 1, claim))
    return dict(given)


def slots_by_owner(holders: Iterable[Claim]) -> Counter[str]:
    """Return the number of slots that jobs hold, by owner."""
    held: Counter[str] = Counter()
    for claim in holders:
        held[claim.owner_id] += claim.outstanding
    return held


def is_at_limit(claim: Claim, held: Mapping[str, int]) -> bool:
    """Return whether a job gets no further order, because its owner holds as many slots as its key allows."""
    return claim.max_slots is not None and held.get(claim.owner_id, 0) >= claim.max_slots


def is_full(claim: Claim, outstanding: int) -> bool:
    """Return whether a job with some outstanding orders gets no further one, by its own limit."""
    return claim.own_slots is not None and outstanding >= claim.own_slots
