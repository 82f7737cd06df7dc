"""The work that waits for slots. Pure: it adds up rows of `service.db.farm`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable

from lippmann.job.rendering.workers import ENGINE_TITLES, JobRequirement
from service.db.farm import WantRow
from service.schemas.farm import WaitingWork


def waiting_work(rows: Iterable[WantRow], *, max_slots: int) -> WaitingWork:
    """Return how many tasks wait and run, and how many slots would have work.

    Parameters
    ----------
    max_slots
        The limit of slots of an owner on the farm; that of a key may be lower.

    >>> waiting_work([("ann", 4, "", 10, 1, 2), ("bob", None, "", 3, 0, 0)], max_slots=100).wanted_slots
    7
    """
    return _added(_shared_out(rows, max_slots))


def waiting_work_for(
    rows: Iterable[WantRow],
    *,
    max_slots: int,
    pool: str,
    tags: Collection[str],
    memory_mb: int | None,
    engines: Collection[str] = tuple(ENGINE_TITLES),
) -> WaitingWork:
    """Return the part of the work that a worker with this pool, these tags, this memory and these engines may do.

    >>> rows = [("ann", None, "", 3, 0, 0), ("ann", None, JobRequirement(pool="night").text, 5, 0, 2)]
    >>> waiting_work_for(rows, max_slots=100, pool="night", tags=(), memory_mb=None).wanted_slots
    7
    """

    def fits(requirement: str) -> bool:
        needed = JobRequirement.of(requirement)
        return not needed.lacks_of(pool=pool, tags=tags, memory_mb=memory_mb, engines=engines)

    return _added((row, gets) for row, gets in _shared_out(rows, max_slots) if fits(row[2]))


def waiting_work_by_engine(rows: Iterable[WantRow], *, max_slots: int) -> dict[str, WaitingWork]:
    """Return the work by the engine that its tasks need, which is `none` for those that render nothing.

    >>> rows = [("ann", None, "", 3, 0, 0), ("ann", None, JobRequirement(engine="mitsuba").text, 5, 0, 2)]
    >>> {engine: work.wanted_slots for engine, work in waiting_work_by_engine(rows, max_slots=100).items()}
    {'povray': 3, 'mitsuba': 7, 'none': 0}
    """
    shared = _shared_out(rows, max_slots)
    return {
        engine: _added((row, gets) for row, gets in shared if JobRequirement.of(row[2]).engine == engine)
        for engine in (*ENGINE_TITLES, "none")
    }


def _shared_out(rows: Iterable[WantRow], max_slots: int) -> list[tuple[WantRow, int]]:
    """Return each row with the number of slots that its ready tasks would get, by the limits of its owner."""
    kept = list(rows)
    held: Counter[str] = Counter()
    for owner, _, _, _, dispatched, running in kept:
        held[owner] += dispatched + running
    shared = []
    # The jobs of a key with a small limit come first: those of another key of the same owner may still take more.
    limits = ((min(max_slots, max_slots if row[1] is None else row[1]), row) for row in kept)
    for limit, row in sorted(limits, key=lambda pair: pair[0]):
        gets = min(row[3], max(0, limit - held[row[0]]))
        held[row[0]] += gets
        shared.append((row, gets))
    return shared


def _added(shared: Iterable[tuple[WantRow, int]]) -> WaitingWork:
    waiting = running = wanted = 0
    for (*_, ready, dispatched, runs), gets in shared:
        waiting += ready + dispatched
        running += runs
        wanted += gets + dispatched + runs
    return WaitingWork(waiting_tasks=waiting, running_tasks=running, wanted_slots=wanted)
