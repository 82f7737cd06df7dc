"""Artifacts by name on a local disk: what is there is whole."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from lippmann.errors import StoreUnavailable
from lippmann.plan.artifact_store import ArtifactStore
from worker.store.local import HIDDEN, LocalStore


def names_in(store: LocalStore, prefix: str = "") -> list[str]:
    return [info.name for info in store.list(prefix)]


def hidden_in(store: LocalStore) -> list[str]:
    return os.listdir(store._hidden)


def test_a_link_takes_no_room(store: LocalStore) -> None:
    store.put_bytes("job/a", b"one")
    store.link("job/a", "cache/b")
    with store.local_path("job/a") as first, store.local_path("cache/b") as second:
        assert first.samefile(second)


def test_a_local_store_is_an_artifact_store(store: LocalStore) -> None:
    as_protocol: ArtifactStore = store
    assert as_protocol is store


def test_a_file_system_without_links_gets_a_copy(store: LocalStore, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EMLINK, "Too many links")

    store.put_bytes("job/a", b"one")
    monkeypatch.setattr(os, "link", refuse)
    store.link("job/a", "job/b")
    assert store.get_bytes("job/b") == b"one"
    with store.local_path("job/a") as first, store.local_path("job/b") as second:
        assert not first.samefile(second)


def test_a_page_of_a_list_looks_into_no_folder_that_it_does_not_show(store: LocalStore) -> None:
    for name in ("a/1", "b/1", "b/2", "c/1", "d/1"):
        store.put_bytes(name, b"x")
    seen: list[str] = []
    scandir = os.scandir

    def seeing(path: Path) -> object:
        seen.append(Path(path).name)
        return scandir(path)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "scandir", seeing)
        assert [info.name for info in store.list("", after="b/1", limit=2)] == ["b/2", "c/1"]
    assert seen == ["artifacts", "b", "c"]


def test_the_room_that_is_left_is_that_of_the_disk(tiny_disk: Path) -> None:
    store = LocalStore(tiny_disk / "artifacts")
    before = store.free_bytes()
    store.put_bytes("a", b"x" * 100_000)
    after = store.free_bytes()
    assert before is not None
    assert after is not None
    assert 90_000 < before - after < 256 * 1024


def test_a_range_nobody_reads_leaves_no_file_open(store: LocalStore) -> None:
    store.put_bytes("a", b"data")
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        store.read_range("a", 0, 4)
    assert len(os.listdir("/proc/self/fd")) == before


def test_every_put_has_its_own_etag_without_quotes(store: LocalStore) -> None:
    tags = []
    for _ in range(50):
        store.put_bytes("a", b"same")
        tags.append(store.etag("a"))
    assert len(set(tags)) == 50
    assert store.etag("a") == tags[-1]
    assert all(tag.isprintable() and '"' not in tag for tag in tags)


def test_a_put_that_is_interrupted_leaves_the_old_artifact_and_nothing_else(store: LocalStore) -> None:
    class Interrupted(Exception):
        pass

    def half() -> Iterator[bytes]:
        yield b"half of it"
        raise Interrupted

    store.put_bytes("job/a", b"old")
    for name in ("job/a", "job/new"):
        with pytest.raises(Interrupted):
            store._put(name, half())
    assert names_in(store) == ["job/a"]
    assert store.get_bytes("job/a") == b"old"
    assert hidden_in(store) == []


KILLED = """
import os, signal, sys
from pathlib import Path
from worker.store.local import LocalStore
store = LocalStore(Path(sys.argv[1]))
def half():
    yield b"half of it" * 100_000
    os.kill(os.getpid(), signal.SIGKILL)
store._put("job/a", half())
"""


def killed_in_mid_put(store: LocalStore) -> None:
    ended = subprocess.run([sys.executable, "-c", KILLED, str(store._root)], timeout=60)
    assert ended.returncode == -9


def test_a_writer_killed_in_mid_put_leaves_nothing_visible(store: LocalStore) -> None:
    killed_in_mid_put(store)
    assert not store.exists("job/a")
    assert names_in(store) == []
    assert len(hidden_in(store)) == 1
    store.put_bytes("job/a", b"again")
    assert names_in(store) == ["job/a"]


def test_what_a_killed_writer_left_is_swept_when_it_is_old_enough(store: LocalStore) -> None:
    killed_in_mid_put(store)
    store.put_bytes("kept", b"")
    assert store.sweep(older_than_s=3600) == 0
    for name in hidden_in(store):
        os.utime(store._hidden / name, (0, 0))
    (store._hidden / "folder" / "half-deleted").mkdir(parents=True)
    os.utime(store._hidden / "folder", (0, 0))
    assert store.sweep(older_than_s=3600) == 2
    assert hidden_in(store) == []
    assert names_in(store) == ["kept"]


def test_a_put_whose_file_is_swept_may_be_tried_again(store: LocalStore) -> None:
    def slow() -> Iterator[bytes]:
        yield b"x"
        assert store.sweep(older_than_s=-1) == 1

    with pytest.raises(StoreUnavailable, match="cannot reach a in the store"):
        store._put("a", slow())
    assert names_in(store) == []


def test_hidden_files_are_not_artifacts(store: LocalStore) -> None:
    store.put_bytes("job/a", b"")
    (store._hidden / "half").write_bytes(b"")
    (store._root / "job" / ".nfs0001").write_bytes(b"")
    assert names_in(store) == ["job/a"]
    assert names_in(store, "job") == ["job/a"]


def test_an_artifact_cannot_lie_below_another(store: LocalStore) -> None:
    store.put_bytes("a", b"old")
    with pytest.raises(StoreUnavailable, match="cannot reach a/b"):
        store.put_bytes("a/b", b"new")
    store.put_bytes("c/d", b"")
    with pytest.raises(StoreUnavailable, match="cannot reach c "):
        store.put_bytes("c", b"")
    assert names_in(store) == ["a", "c/d"]
    assert hidden_in(store) == []


def test_everybody_whom_the_umask_allows_may_read(store: LocalStore) -> None:
    before = os.umask(0o022)
    try:
        store.put_bytes("a", b"")
    finally:
        os.umask(before)
    with store.local_path("a") as path:
        assert path.stat().st_mode & 0o777 == 0o644


def test_a_store_whose_disk_went_away_is_unavailable_and_not_made_anew(store: LocalStore) -> None:
    store._root.rename(store._root.with_name("unmounted"))
    with pytest.raises(StoreUnavailable):
        store.put_bytes("job/a", b"")
    assert not store._root.exists()


def test_the_hidden_folder_has_its_known_name(store: LocalStore) -> None:
    assert store._hidden == store._root / HIDDEN
