"""The work that waits for slots. Pure: it adds up rows of `service.db.farm`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from service.db.farm import WantRow
from service.schemas.farm import WaitingWork


def waiting_work(rows: Iterable[WantRow], *, max_slots: int) -> WaitingWork:
    """Return how many tasks wait and run, and how many slots would have work.

    Parameters
    ----------
    max_slots
        The limit of slots of an owner whose key has none.

    >>> waiting_work([("ann", 4, 10, 1, 2), ("bob", None, 3, 0, 0)], max_slots=100).wanted_slots
    7
    """
    kept = list(rows)
    held: Counter[str] = Counter()
    for owner, _, _, dispatched, running in kept:
        held[owner] += dispatched + running
    # The jobs of a key with a small limit come first: those of another key of the same owner may still take more.
    for owner, limit, ready, _, _ in sorted(kept, key=lambda row: max_slots if row[1] is None else row[1]):
        held[owner] += min(ready, max(0, (max_slots if limit is None else limit) - held[owner]))
    return WaitingWork(
        waiting_tasks=sum(ready + dispatched for _, _, ready, dispatched, _ in kept),
        running_tasks=sum(running for *_, running in kept),
        wanted_slots=held.total(),
    )
