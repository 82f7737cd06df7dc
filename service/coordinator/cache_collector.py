"""The collector of the render cache removes entries that nobody has used for long, and the oldest beyond a size.

An entry and the jobs that use it share their files, and each keeps them when the other is deleted, so nothing has to be
asked before an entry is removed. A worker that uses an entry at the same moment finds it incomplete and renders.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass

import structlog

from lippmann.plan.artifact_store import ArtifactInfo, ArtifactStore
from lippmann.plan.render_cache import CACHE, ENTRY
from service.settings import Settings

INCOMPLETE_S = 3600.0
"""The age at which an entry without `entry.json` is removed; a worker stores the files of an entry within seconds."""
DAY_S = 86_400.0
_PAGE = 10_000

log = structlog.get_logger("service.cache_collector")


@dataclass
class Entry:
    """An entry of the cache as the collector sees it."""

    size: int = 0
    """The bytes of its files; while a job that uses them is there, removing the entry frees none of them."""
    newest_s: float = 0.0
    used_s: float | None = None
    """The time of the last use; None for an entry that is incomplete."""


def collect_cache(store: ArtifactStore, settings: Settings, *, now_s: float) -> int:
    """Remove entries of the render cache by age and total size, the least recently used first; return their number."""
    entries = cache_entries(store)
    removed = [folder for folder, entry in entries.items() if _is_old(entry, settings, now_s)]
    kept = sorted((folder for folder in entries if folder not in set(removed)), key=lambda each: _used_s(entries[each]))
    too_many = sum(entries[folder].size for folder in kept) - settings.cache_max_bytes
    for folder in kept:
        if too_many <= 0:
            break
        too_many -= entries[folder].size
        removed.append(folder)
    for folder in removed:
        store.delete(folder)
    if removed:
        log.info("entries of the render cache removed", count=len(removed), kept=len(entries) - len(removed))
    return len(removed)


def drop_cache(store: ArtifactStore) -> bool:
    """Remove the whole render cache, because the store is full; return whether there was any."""
    if not store.list(CACHE, limit=1):
        return False
    store.delete(CACHE)
    log.warning("the render cache was removed, because the store is full")
    return True


def cache_entries(store: ArtifactStore) -> dict[str, Entry]:
    """Return the entries of the render cache by their folders."""
    entries: dict[str, Entry] = defaultdict(Entry)
    for info in _infos(store):
        folder, _, file = info.name.rpartition("/")
        entry = entries[folder]
        entry.size += info.size
        entry.newest_s = max(entry.newest_s, info.modified_s)
        if file == ENTRY:
            entry.used_s = info.modified_s
    return dict(entries)


def _infos(store: ArtifactStore) -> Iterator[ArtifactInfo]:
    after = ""
    while page := store.list(CACHE, after=after, limit=_PAGE):
        yield from page
        after = page[-1].name


def _used_s(entry: Entry) -> float:
    return entry.newest_s if entry.used_s is None else entry.used_s


def _is_old(entry: Entry, settings: Settings, now_s: float) -> bool:
    least_s = INCOMPLETE_S if entry.used_s is None else settings.cache_max_age_days * DAY_S
    return now_s - _used_s(entry) > least_s
