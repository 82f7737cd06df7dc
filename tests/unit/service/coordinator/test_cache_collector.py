"""The render cache keeps what was used of late, up to its size, and gives way when the store is full."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from lippmann.plan.render_cache import CACHE, ENTRY, LOG, TILE, entry_folder
from service.coordinator.cache_collector import INCOMPLETE_S, cache_entries, collect_cache, drop_cache
from service.settings import Settings
from service.store_check import StoreCheck
from tests.builders_service import T0, DictStore
from worker.store.local import LocalStore

DAY_S = 86_400.0
KEYS = [f"{number}{number}" * 32 for number in range(5)]
MB = 1_000_000


def with_entries(used_s: list[float], *, size: int = MB) -> DictStore:
    """Return a store with entries that were last used at some times, each rendered at T0."""
    store = DictStore(files={"scenes/0a.zip": b"bundle", "1q9gd6e00m0d73pex/tiles/0001/00-00.exr": b"tile"})
    for key, at_s in zip(KEYS, used_s, strict=False):
        store.put_bytes(f"{entry_folder(key)}/{TILE}", bytes(size))
        store.put_bytes(f"{entry_folder(key)}/{ENTRY}", b"{}")
        store.written_s[f"{entry_folder(key)}/{ENTRY}"] = at_s
    return store


def kept(store: DictStore) -> list[str]:
    """Return the first letters of the keys of the entries, and fail if one has been removed in part."""
    entries = cache_entries(store)
    assert all(f"{folder}/{TILE}" in store.files and f"{folder}/{ENTRY}" in store.files for folder in entries)
    return [folder.rpartition("/")[2][0] for folder in entries]


def settings(**more: float) -> Settings:
    return Settings.model_validate(more)


def test_entries_that_nobody_used_for_long_are_removed() -> None:
    now_s = T0 + 40 * DAY_S
    store = with_entries([now_s - 31 * DAY_S, now_s - 29 * DAY_S, now_s])
    assert collect_cache(store, settings(), now_s=now_s) == 1
    assert kept(store) == ["1", "2"]
    assert collect_cache(store, settings(cache_max_age_days=28), now_s=now_s) == 1
    assert kept(store) == ["2"]


def test_beyond_the_size_the_least_recently_used_are_removed() -> None:
    store = with_entries([T0 + 50, T0 + 20, T0 + 40, T0 + 10, T0 + 30])
    assert collect_cache(store, settings(cache_max_mb=5.1), now_s=T0 + 60) == 0
    assert collect_cache(store, settings(cache_max_mb=3.1), now_s=T0 + 60) == 2
    assert kept(store) == ["0", "2", "4"]
    assert collect_cache(store, settings(cache_max_mb=0), now_s=T0 + 60) == 3
    assert list(store.files) == ["scenes/0a.zip", "1q9gd6e00m0d73pex/tiles/0001/00-00.exr"]


def test_an_entry_that_is_incomplete_is_removed_after_an_hour() -> None:
    store = with_entries([T0 + INCOMPLETE_S])
    store.put_bytes(f"{entry_folder(KEYS[1])}/{LOG}", b"no entry.json")
    assert collect_cache(store, settings(), now_s=T0 + INCOMPLETE_S - 1) == 0
    assert collect_cache(store, settings(), now_s=T0 + INCOMPLETE_S + 1) == 1
    assert kept(store) == ["0"]


def test_the_cache_is_read_in_pages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("service.coordinator.cache_collector._PAGE", 3)
    store = with_entries([T0] * 5)
    assert [entry.size for entry in cache_entries(store).values()] == [MB + 2] * 5


def test_a_job_keeps_the_files_of_an_entry_that_is_removed(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    folder = entry_folder(KEYS[0])
    store.put_bytes("job/tiles/0001/00-00.exr", b"pixels")
    store.link("job/tiles/0001/00-00.exr", f"{folder}/{TILE}")
    store.put_bytes(f"{folder}/{ENTRY}", b"{}")
    os.utime(tmp_path / folder / ENTRY, (T0, T0))
    assert collect_cache(store, settings(), now_s=T0 + 29 * DAY_S) == 0
    assert collect_cache(store, settings(), now_s=T0 + 31 * DAY_S) == 1
    assert store.list(CACHE) == []
    assert store.get_bytes("job/tiles/0001/00-00.exr") == b"pixels"


class FullOfCache(DictStore):
    """A store that has room only without its cache."""

    def free_bytes(self) -> int:
        return MB if any(name.startswith(f"{CACHE}/") for name in self.files) else 1000 * MB


def test_a_full_store_gives_up_its_cache_and_is_not_full_then() -> None:
    store = FullOfCache(files=with_entries([T0]).files)
    assert StoreCheck(store, reserve_bytes=50 * MB).error() is not None
    assert StoreCheck(store, reserve_bytes=50 * MB, make_room=lambda: drop_cache(store)).error() is None
    assert list(store.files) == ["scenes/0a.zip", "1q9gd6e00m0d73pex/tiles/0001/00-00.exr"]
    assert not drop_cache(store)


def test_a_store_that_is_full_without_a_cache_is_full() -> None:
    store = DictStore(free=MB)
    check = StoreCheck(store, reserve_bytes=50 * MB, make_room=lambda: drop_cache(store))
    assert check.error() is not None
    assert not store.files
