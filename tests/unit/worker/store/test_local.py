"""Artifacts by name on a local disk: what is there is whole."""

from __future__ import annotations

import errno
import hashlib
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lippmann.digest import Digest
from lippmann.errors import ArtifactMissing, StoreUnavailable
from lippmann.plan.artifact_store import ArtifactStore, read_digest
from worker.store.local import CHUNK_BYTES, HIDDEN, LocalStore

NAMES = st.lists(st.text("abc01-_", min_size=1, max_size=4), min_size=1, max_size=4).map("/".join)


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> LocalStore:
    return LocalStore(tmp_path_factory.mktemp("store"))


def names_in(store: LocalStore, prefix: str = "") -> list[str]:
    return [info.name for info in store.list(prefix)]


def hidden_in(store: LocalStore) -> list[str]:
    return os.listdir(store._hidden)


def test_a_local_store_is_an_artifact_store(store: LocalStore) -> None:
    as_protocol: ArtifactStore = store
    assert as_protocol is store


@given(data=st.binary(max_size=5000))
def test_what_is_put_comes_back(shared: LocalStore, data: bytes) -> None:
    shared.put_bytes("job/a.bin", data)
    assert shared.get_bytes("job/a.bin") == data
    assert shared.size("job/a.bin") == len(data)
    assert shared.exists("job/a.bin")
    with shared.local_path("job/a.bin") as path:
        assert path.read_bytes() == data


@given(data=st.binary(max_size=3000), edges=st.tuples(st.integers(0, 4000), st.integers(0, 4000)).map(sorted))
def test_a_range_is_that_part_of_the_whole(shared: LocalStore, data: bytes, edges: list[int]) -> None:
    shared.put_bytes("job/r.bin", data)
    assert b"".join(shared.read_range("job/r.bin", *edges)) == data[slice(*edges)]


def test_a_link_is_a_second_name_of_a_content_that_each_name_keeps(store: LocalStore) -> None:
    store.put_bytes("job/a", b"one")
    store.put_bytes("cache/b", b"old")
    store.link("job/a", "cache/b")
    store.link("job/a", "cache/b")
    assert store.get_bytes("cache/b") == b"one"
    with store.local_path("job/a") as first, store.local_path("cache/b") as second:
        assert first.samefile(second)
    store.put_bytes("job/a", b"two")
    assert store.get_bytes("cache/b") == b"one"
    store.link("cache/b", "job/c/d")
    store.delete("cache")
    assert (store.get_bytes("job/a"), store.get_bytes("job/c/d")) == (b"two", b"one")
    assert hidden_in(store) == []


@pytest.mark.parametrize("source", ["job/none", "job", "none/x"])
def test_a_link_to_nothing_is_a_missing_artifact(store: LocalStore, source: str) -> None:
    store.put_bytes("job/a", b"one")
    with pytest.raises(ArtifactMissing):
        store.link(source, "job/b")
    assert names_in(store) == ["job/a"]
    assert hidden_in(store) == []


def test_a_file_system_without_links_gets_a_copy(store: LocalStore, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.EMLINK, "Too many links")

    store.put_bytes("job/a", b"one")
    monkeypatch.setattr(os, "link", refuse)
    store.link("job/a", "job/b")
    assert store.get_bytes("job/b") == b"one"
    with store.local_path("job/a") as first, store.local_path("job/b") as second:
        assert not first.samefile(second)


@given(names=st.sets(NAMES, max_size=8), prefix=NAMES)
def test_a_list_is_sorted_and_holds_whole_parts_below_the_prefix(
    tmp_path_factory: pytest.TempPathFactory, names: set[str], prefix: str
) -> None:
    store = LocalStore(tmp_path_factory.mktemp("list"))
    # A name cannot be an artifact and a folder of others.
    kept = {name for name in names if not any(other.startswith(name + "/") for other in names)}
    for name in kept:
        store.put_bytes(name, name.encode())
    assert names_in(store) == sorted(kept)
    below = sorted(name for name in kept if name == prefix or name.startswith(prefix + "/"))
    assert names_in(store, prefix) == names_in(store, prefix + "/") == below
    for info in store.list(prefix):
        assert (info.size, info.etag) == (store.size(info.name), store.etag(info.name))


@given(names=st.sets(NAMES, max_size=8), after=NAMES, limit=st.integers(0, 4))
def test_pages_of_a_list_are_the_list(
    tmp_path_factory: pytest.TempPathFactory, names: set[str], after: str, limit: int
) -> None:
    store = LocalStore(tmp_path_factory.mktemp("pages"))
    kept = {name for name in names if not any(other.startswith(name + "/") for other in names)}
    for name in kept:
        store.put_bytes(name, b"x")
    following = sorted(name for name in kept if name > after)
    assert [info.name for info in store.list("", after=after)] == following
    assert [info.name for info in store.list("", after=after, limit=limit)] == following[:limit]
    assert store.folders() == sorted({name.partition("/")[0] for name in kept if "/" in name})


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


def test_a_large_artifact_is_read_in_chunks(store: LocalStore) -> None:
    data = os.urandom(2 * CHUNK_BYTES + 17)
    store.put_bytes("a", data)
    chunks = list(store.read_range("a", 5, len(data)))
    assert [len(chunk) for chunk in chunks] == [CHUNK_BYTES, CHUNK_BYTES, 12]
    assert b"".join(chunks) == data[5:]


def test_a_reader_goes_on_reading_what_he_opened(store: LocalStore) -> None:
    old, new = b"o" * 2 * CHUNK_BYTES, b"n" * 2 * CHUNK_BYTES
    store.put_bytes("a", old)
    chunks = store.read_range("a", 0, len(old))
    first = next(chunks)
    store.put_bytes("a", new)
    store.delete("a")
    assert first + b"".join(chunks) == old


def test_a_range_nobody_reads_leaves_no_file_open(store: LocalStore) -> None:
    store.put_bytes("a", b"data")
    before = len(os.listdir("/proc/self/fd"))
    for _ in range(5):
        store.read_range("a", 0, 4)
    assert len(os.listdir("/proc/self/fd")) == before


@pytest.mark.parametrize(("start", "stop"), [(-1, 2), (3, 2)])
def test_a_range_that_is_none_is_refused(store: LocalStore, start: int, stop: int) -> None:
    store.put_bytes("a", b"data")
    with pytest.raises(ValueError, match="expected bytes"):
        store.read_range("a", start, stop)


def test_the_digest_of_a_put_is_that_of_what_is_stored(store: LocalStore, tmp_path: Path) -> None:
    data = os.urandom(700_001)
    expected = Digest(len(data), hashlib.sha256(data).hexdigest())
    (tmp_path / "source").write_bytes(data)
    assert store.put_bytes("a", data) == expected
    assert store.put_file("b", tmp_path / "source") == expected
    assert read_digest(store, "b") == expected


def test_a_file_is_copied_and_stays(store: LocalStore, tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(os.urandom(3 * CHUNK_BYTES))
    store.put_file("job/video/a.mp4", source)
    assert store.get_bytes("job/video/a.mp4") == source.read_bytes()


def test_a_source_that_is_missing_is_the_callers_fault(store: LocalStore, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        store.put_file("a", tmp_path / "none")
    assert not store.exists("a")


def test_every_put_has_its_own_etag_without_quotes(store: LocalStore) -> None:
    tags = []
    for _ in range(50):
        store.put_bytes("a", b"same")
        tags.append(store.etag("a"))
    assert len(set(tags)) == 50
    assert store.etag("a") == tags[-1]
    assert all(tag.isprintable() and '"' not in tag for tag in tags)


@pytest.mark.parametrize("name", ["none", "job/none", "job", "job/a/below"])
def test_what_is_not_there_is_missing(store: LocalStore, name: str) -> None:
    store.put_bytes("job/a", b"")
    assert not store.exists(name)
    for ask in (store.get_bytes, store.size, store.etag, lambda n: store.read_range(n, 0, 1)):
        with pytest.raises(ArtifactMissing, match=f"the artifact {name}"):
            ask(name)
    with pytest.raises(ArtifactMissing), store.local_path(name):
        pass


BAD_NAMES = ["", "/", "/etc/passwd", "..", "a/../b", "../a", "./a", "a//b", "a/", "a\0b", "a\nb", ".partial/x", "a/.b"]


@pytest.mark.parametrize("name", [*BAD_NAMES, "x" * 256, "x/" * 600 + "x", "\udc80"])
def test_a_name_that_is_none_is_refused_everywhere(store: LocalStore, name: str, tmp_path: Path) -> None:
    (tmp_path / "source").write_bytes(b"")
    for ask in (
        lambda: store.put_bytes(name, b""),
        lambda: store.put_file(name, tmp_path / "source"),
        lambda: store.get_bytes(name),
        lambda: store.exists(name),
        lambda: store.size(name),
        lambda: store.etag(name),
        lambda: store.read_range(name, 0, 1),
        lambda: store.local_path(name).__enter__(),
    ):
        with pytest.raises(ValueError, match=r"artifact's name|surrogates"):
            ask()
    assert names_in(store) == hidden_in(store) == []


@pytest.mark.parametrize("prefix", ["/", "..", "a/..", "/a", "a//", ".partial"])
def test_a_prefix_that_is_none_is_refused(store: LocalStore, prefix: str) -> None:
    for ask in (store.list, store.delete):
        with pytest.raises(ValueError, match="artifact's name"):
            ask(prefix)


def test_deleting_takes_whole_parts_and_leaves_the_neighbours(store: LocalStore) -> None:
    for name in ("job1/a", "job1/b/c", "job10/a", "job2"):
        store.put_bytes(name, b"")
    store.delete("job1")
    assert names_in(store) == ["job10/a", "job2"]
    store.delete("job2")
    store.delete("job2")
    store.delete("job2/below")
    assert names_in(store) == ["job10/a"]
    assert hidden_in(store) == []


def test_deleting_everything_is_refused(store: LocalStore) -> None:
    store.put_bytes("a", b"")
    with pytest.raises(ValueError, match="every artifact of every job"):
        store.delete("")
    assert store.exists("a")


def test_deleted_artifacts_may_be_put_again(store: LocalStore) -> None:
    store.put_bytes("job/a", b"1")
    store.delete("job")
    store.put_bytes("job/a", b"2")
    assert store.get_bytes("job/a") == b"2"


def test_two_writers_of_one_name_end_with_one_whole_artifact(store: LocalStore) -> None:
    contents = [bytes([letter]) * 500_000 for letter in b"abcdefgh"]
    together = Barrier(len(contents))

    def put(data: bytes) -> None:
        together.wait()
        store.put_bytes("job/deep/er/a", data)

    with ThreadPoolExecutor(len(contents)) as pool:
        list(pool.map(put, contents))
    assert store.get_bytes("job/deep/er/a") in contents
    assert hidden_in(store) == []


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


def test_listing_while_artifacts_come_and_go_never_fails(store: LocalStore) -> None:
    store.put_bytes("kept/a", b"")

    def come_and_go() -> Iterator[None]:
        for number in range(60):
            store.put_bytes(f"job{number % 3}/deep/a", b"x")
            store.delete(f"job{number % 3}")
            yield

    with ThreadPoolExecutor(1) as pool:
        done = pool.submit(lambda: list(come_and_go()))
        while not done.done():
            assert "kept/a" in names_in(store)
        done.result()


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
