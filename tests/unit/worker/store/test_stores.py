"""Artifacts by name, on a disk and in a bucket: what is there is whole."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from threading import Barrier

import pytest
from boto3.s3.transfer import TransferConfig
from hypothesis import example, given, settings
from hypothesis import strategies as st

from lippmann.digest import Digest
from lippmann.errors import ArtifactMissing
from lippmann.plan.artifact_store import ArtifactStore, LeavesPartialFiles, read_digest
from worker.store import s3
from worker.store.local import CHUNK_BYTES, LocalStore
from worker.store.s3 import S3Store

few = settings(max_examples=20)
"""Each example makes many requests of a server."""
NAMES = st.lists(st.text("abc01-_", min_size=1, max_size=4), min_size=1, max_size=4).map("/".join)

MakeStore = Callable[[], ArtifactStore]


@pytest.fixture(scope="module", params=["disk", "bucket"])
def make_store(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> MakeStore:
    if request.param == "disk":
        return lambda: LocalStore(tmp_path_factory.mktemp("store"))
    server = request.getfixturevalue("object_store")
    bucket, numbers, copies = server.new_bucket(), count(), tmp_path_factory.mktemp("copies")
    return lambda: S3Store(bucket, copies=copies, prefix=f"farm{next(numbers)}", endpoint=server.endpoint)


@pytest.fixture
def store(make_store: MakeStore) -> ArtifactStore:
    return make_store()


@pytest.fixture(scope="module")
def shared(make_store: MakeStore) -> ArtifactStore:
    return make_store()


def names_in(store: ArtifactStore, prefix: str = "") -> list[str]:
    return [info.name for info in store.list(prefix)]


def partial_in(store: ArtifactStore) -> int:
    assert isinstance(store, LeavesPartialFiles)
    return store.count_partial(older_than_s=-60.0)


def test_a_transfer_gives_signs_of_life_while_bytes_are_moved(
    store: ArtifactStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bytes of a large artifact may flow for hours."""
    monkeypatch.setattr(s3, "PART_BYTES", 5 << 20)
    monkeypatch.setattr(s3, "_IN_PARTS", TransferConfig(multipart_threshold=5 << 20, multipart_chunksize=5 << 20))
    signs: list[None] = []
    (tmp_path / "large").write_bytes(os.urandom(11 << 20))
    sent = store.put_file("a", tmp_path / "large", moved=lambda: signs.append(None))
    # Reading the file for its digest gives as many as there are chunks, and sending its parts gives further ones.
    chunks = (11 << 20) // CHUNK_BYTES
    assert len(signs) >= chunks + 3 * isinstance(store, S3Store)
    signs.clear()
    assert read_digest(store, "a", moved=lambda: signs.append(None)) == sent
    assert len(signs) >= chunks
    signs.clear()
    with store.local_path("a", moved=lambda: signs.append(None)) as path:
        assert path.stat().st_size == 11 << 20
    assert len(signs) >= chunks * isinstance(store, S3Store)


@few
@given(data=st.binary(max_size=5000))
def test_what_is_put_comes_back(shared: ArtifactStore, data: bytes) -> None:
    shared.put_bytes("job/a.bin", data)
    assert shared.get_bytes("job/a.bin") == data
    assert shared.size("job/a.bin") == len(data)
    assert shared.exists("job/a.bin")
    with shared.local_path("job/a.bin") as path:
        assert path.read_bytes() == data


@few
@given(data=st.binary(max_size=3000), edges=st.tuples(st.integers(0, 4000), st.integers(0, 4000)).map(sorted))
def test_a_range_is_that_part_of_the_whole(shared: ArtifactStore, data: bytes, edges: list[int]) -> None:
    shared.put_bytes("job/r.bin", data)
    assert b"".join(shared.read_range("job/r.bin", *edges)) == data[slice(*edges)]


def test_a_link_is_a_second_name_of_a_content_that_each_name_keeps(store: ArtifactStore) -> None:
    store.put_bytes("job/a", b"one")
    store.put_bytes("cache/b", b"old")
    store.link("job/a", "cache/b")
    store.link("job/a", "cache/b")
    assert store.get_bytes("cache/b") == b"one"
    store.put_bytes("job/a", b"two")
    assert store.get_bytes("cache/b") == b"one"
    store.link("cache/b", "job/c/d")
    store.delete("cache")
    assert (store.get_bytes("job/a"), store.get_bytes("job/c/d")) == (b"two", b"one")
    assert partial_in(store) == 0


@pytest.mark.parametrize("source", ["job/none", "job", "none/x"])
def test_a_link_to_nothing_is_a_missing_artifact(store: ArtifactStore, source: str) -> None:
    store.put_bytes("job/a", b"one")
    with pytest.raises(ArtifactMissing):
        store.link(source, "job/b")
    assert names_in(store) == ["job/a"]
    assert partial_in(store) == 0


@few
@given(names=st.sets(NAMES, max_size=8), prefix=NAMES)
@example(names={"a/b", "a-b", "a0", "b"}, prefix="a")  # SeaweedFS lists a/b before a-b.
def test_a_list_is_sorted_and_holds_whole_parts_below_the_prefix(
    make_store: MakeStore, names: set[str], prefix: str
) -> None:
    store = make_store()
    # A name cannot be an artifact and a folder of others.
    kept = {name for name in names if not any(other.startswith(name + "/") for other in names)}
    for name in kept:
        store.put_bytes(name, name.encode())
    assert names_in(store) == sorted(kept)
    below = sorted(name for name in kept if name == prefix or name.startswith(prefix + "/"))
    assert names_in(store, prefix) == names_in(store, prefix + "/") == below
    for info in store.list(prefix):
        found = store.info(info.name)
        assert (info.size, info.etag) == (found.size, found.etag) == (store.size(info.name), store.etag(info.name))
        assert abs(info.modified_s - found.modified_s) <= 1.0


@few
@given(names=st.sets(NAMES, max_size=8), after=NAMES, limit=st.integers(0, 4))
@example(names={"a/b", "a-b", "a0", "b"}, after="a-b", limit=1)
def test_pages_of_a_list_are_the_list(make_store: MakeStore, names: set[str], after: str, limit: int) -> None:
    store = make_store()
    kept = {name for name in names if not any(other.startswith(name + "/") for other in names)}
    for name in kept:
        store.put_bytes(name, b"x")
    following = sorted(name for name in kept if name > after)
    assert [info.name for info in store.list("", after=after)] == following
    assert [info.name for info in store.list("", after=after, limit=limit)] == following[:limit]
    assert store.folders() == sorted({name.partition("/")[0] for name in kept if "/" in name})


def test_a_large_artifact_is_read_in_chunks(store: ArtifactStore) -> None:
    data = os.urandom(2 * CHUNK_BYTES + 17)
    store.put_bytes("a", data)
    chunks = list(store.read_range("a", 5, len(data)))
    assert [len(chunk) for chunk in chunks] == [CHUNK_BYTES, CHUNK_BYTES, 12]
    assert b"".join(chunks) == data[5:]


def test_a_reader_goes_on_reading_what_he_opened(store: ArtifactStore) -> None:
    old, new = b"o" * 2 * CHUNK_BYTES, b"n" * 2 * CHUNK_BYTES
    store.put_bytes("a", old)
    chunks = store.read_range("a", 0, len(old))
    first = next(chunks)
    store.put_bytes("a", new)
    store.delete("a")
    assert first + b"".join(chunks) == old


@pytest.mark.parametrize(("start", "stop"), [(-1, 2), (3, 2)])
def test_a_range_that_is_none_is_refused(store: ArtifactStore, start: int, stop: int) -> None:
    store.put_bytes("a", b"data")
    with pytest.raises(ValueError, match="expected bytes"):
        store.read_range("a", start, stop)


def test_the_digest_of_a_put_is_that_of_what_is_stored(store: ArtifactStore, tmp_path: Path) -> None:
    data = os.urandom(700_001)
    expected = Digest(len(data), hashlib.sha256(data).hexdigest())
    (tmp_path / "source").write_bytes(data)
    assert store.put_bytes("a", data) == expected
    assert store.put_file("b", tmp_path / "source") == expected
    assert read_digest(store, "b") == expected


def test_a_file_is_copied_and_stays(store: ArtifactStore, tmp_path: Path) -> None:
    source = tmp_path / "source"
    source.write_bytes(os.urandom(3 * CHUNK_BYTES))
    store.put_file("job/video/a.mp4", source)
    assert store.get_bytes("job/video/a.mp4") == source.read_bytes()


def test_a_source_that_is_missing_is_the_callers_fault(store: ArtifactStore, tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        store.put_file("a", tmp_path / "none")
    assert not store.exists("a")


@pytest.mark.parametrize("name", ["none", "job/none", "job", "job/a/below"])
def test_what_is_not_there_is_missing(store: ArtifactStore, name: str) -> None:
    store.put_bytes("job/a", b"")
    assert not store.exists(name)
    for ask in (store.get_bytes, store.size, store.etag, store.info, lambda n: store.read_range(n, 0, 1)):
        with pytest.raises(ArtifactMissing, match=f"the artifact {name}"):
            ask(name)
    with pytest.raises(ArtifactMissing), store.local_path(name):
        pass


BAD_NAMES = ["", "/", "/etc/passwd", "..", "a/../b", "../a", "./a", "a//b", "a/", "a\0b", "a\nb", ".partial/x", "a/.b"]


@pytest.mark.parametrize("name", [*BAD_NAMES, "x" * 256, "x/" * 600 + "x", "\udc80"])
def test_a_name_that_is_none_is_refused_everywhere(store: ArtifactStore, name: str, tmp_path: Path) -> None:
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
    assert names_in(store) == []
    assert partial_in(store) == 0


@pytest.mark.parametrize("prefix", ["/", "..", "a/..", "/a", "a//", ".partial"])
def test_a_prefix_that_is_none_is_refused(store: ArtifactStore, prefix: str) -> None:
    for ask in (store.list, store.delete):
        with pytest.raises(ValueError, match="artifact's name"):
            ask(prefix)


def test_deleting_takes_whole_parts_and_leaves_the_neighbours(store: ArtifactStore) -> None:
    for name in ("job1/a", "job1/b/c", "job10/a", "job2"):
        store.put_bytes(name, b"")
    store.delete("job1")
    assert names_in(store) == ["job10/a", "job2"]
    store.delete("job2")
    store.delete("job2")
    store.delete("job2/below")
    assert names_in(store) == ["job10/a"]
    assert partial_in(store) == 0


def test_deleting_everything_is_refused(store: ArtifactStore) -> None:
    store.put_bytes("a", b"")
    with pytest.raises(ValueError, match="every artifact of every job"):
        store.delete("")
    assert store.exists("a")


def test_deleted_artifacts_may_be_put_again(store: ArtifactStore) -> None:
    store.put_bytes("job/a", b"1")
    store.delete("job")
    store.put_bytes("job/a", b"2")
    assert store.get_bytes("job/a") == b"2"


def test_two_writers_of_one_name_end_with_one_whole_artifact(store: ArtifactStore) -> None:
    contents = [bytes([letter]) * 500_000 for letter in b"abcdefgh"]
    together = Barrier(len(contents))

    def put(data: bytes) -> None:
        together.wait()
        store.put_bytes("job/deep/er/a", data)

    with ThreadPoolExecutor(len(contents)) as pool:
        list(pool.map(put, contents))
    assert store.get_bytes("job/deep/er/a") in contents
    assert partial_in(store) == 0


def test_listing_while_artifacts_come_and_go_never_fails(store: ArtifactStore) -> None:
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
