"""A disk that is full, or may not be written to."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from lippmann.errors import StoreFull, StoreUnavailable
from tests.unit.worker.store.conftest import TINY_BYTES
from tests.waiting import ENOUGH_S
from worker.images.write import write_code_rows, write_exr
from worker.store.local import LocalStore
from worker.video.encode import encode
from worker.video.kinds import FFV1, H264


def test_a_full_disk_is_said_and_the_old_artifact_stays(tiny_disk: Path, tmp_path: Path) -> None:
    store = LocalStore(tiny_disk / "artifacts")
    store.put_bytes("job/a", b"old")
    with pytest.raises(StoreFull, match="no room for job/a: No space left"):
        store.put_bytes("job/a", os.urandom(TINY_BYTES))
    (tmp_path / "large").write_bytes(os.urandom(TINY_BYTES))
    with pytest.raises(StoreFull, match="no room for job/b"):
        store.put_file("job/b", tmp_path / "large")
    assert [info.name for info in store.list("")] == ["job/a"]
    assert store.get_bytes("job/a") == b"old"
    # Nothing half-written takes up the room.
    store.put_bytes("job/a", os.urandom(TINY_BYTES // 2))


def test_a_disk_that_is_read_only_is_unavailable(tiny_disk: Path) -> None:
    store = LocalStore(tiny_disk / "artifacts")
    store.put_bytes("a", b"old")
    subprocess.run(["mount", "-o", "remount,ro", str(tiny_disk)], check=True, timeout=ENOUGH_S)
    with pytest.raises(StoreUnavailable, match="Read-only file system"):
        store.put_bytes("a", b"new")
    with pytest.raises(StoreUnavailable, match="Read-only file system"):
        store.delete("a")
    assert store.get_bytes("a") == b"old"
    with pytest.raises(StoreUnavailable, match="Read-only file system"):
        LocalStore(tiny_disk / "other")


def test_in_a_store_that_is_away_nothing_is_missing(tmp_path: Path) -> None:
    """Otherwise every artifact would seem to be lost and would be made again."""
    store = LocalStore(tmp_path / "artifacts")
    store.put_bytes("job/a", b"a")
    (tmp_path / "artifacts").rename(tmp_path / "away")
    asked: list[Callable[[str], object]] = [store.get_bytes, store.exists, store.size, store.etag]
    for ask in asked:
        with pytest.raises(StoreUnavailable, match="cannot reach job/a in the store"):
            ask("job/a")
    (tmp_path / "away").rename(tmp_path / "artifacts")
    assert (store.exists("job/a"), store.exists("job/b")) == (True, False)


def test_an_empty_folder_in_the_place_of_the_store_is_no_store_without_artifacts(tmp_path: Path) -> None:
    """An unmounted disk leaves an empty folder, in which a process that starts makes its hidden folder."""
    root = tmp_path / "artifacts"
    identity = LocalStore(root).make_identity()
    LocalStore(root).put_bytes("job/a", b"a")
    root.rename(tmp_path / "disk")
    store = LocalStore(root)
    store.expect(identity)
    asked: list[Callable[[], object]] = [
        lambda: store.exists("job/a"),
        lambda: store.get_bytes("job/a"),
        lambda: store.size("job/a"),
        lambda: store.list("job"),
        store.folders,
        lambda: store.put_bytes("job/b", b"b"),
        lambda: store.link("job/a", "job/b"),
        lambda: store.delete("job"),
    ]
    for number, ask in enumerate(asked):
        with pytest.raises(StoreUnavailable, match="the folder in its place has no id"):
            ask()
        assert [path.name for path in root.iterdir()] == [".partial"], number
    shutil.rmtree(root)
    (tmp_path / "disk").rename(root)
    assert (store.exists("job/a"), store.exists("job/b")) == (True, False)
    store.put_bytes("job/b", b"b")


def test_nothing_of_another_store_is_deleted_or_changed(tmp_path: Path) -> None:
    other = LocalStore(tmp_path)
    other.make_identity()
    other.put_bytes("job/a", b"a")
    store = LocalStore(tmp_path)
    store.expect("0123")
    asked: list[Callable[[], object]] = [
        lambda: store.delete("job"),
        lambda: store.put_bytes("job/a", b"b"),
        lambda: store.link("job/a", "job/b"),
        store.folders,
    ]
    for ask in asked:
        with pytest.raises(StoreUnavailable, match="is another store"):
            ask()
    assert [info.name for info in other.list("")] == ["job/a"]
    assert other.get_bytes("job/a") == b"a"


def test_the_id_of_a_store_is_made_once(tmp_path: Path) -> None:
    assert LocalStore(tmp_path).identity() is None
    with ThreadPoolExecutor(8) as pool:
        made = {*pool.map(lambda _: LocalStore(tmp_path).make_identity(), range(8))}
    assert made == {LocalStore(tmp_path).identity()}
    assert LocalStore(tmp_path).list("") == []
    assert list((tmp_path / ".partial").iterdir()) == []


def test_artifacts_leave_the_reserve_free(tiny_disk: Path) -> None:
    store = LocalStore(tiny_disk / "artifacts", reserve_bytes=TINY_BYTES // 2)
    store.put_bytes("a", bytes(TINY_BYTES // 4))
    with pytest.raises(StoreFull, match="no room for b: 0 MB are free, and 0 MB are kept in reserve"):
        store.put_bytes("b", bytes(TINY_BYTES // 2))
    assert [info.name for info in store.list("")] == ["a"]
    store.delete("a")


def test_pictures_and_videos_on_any_nearly_full_disk_are_whole_or_refused(tiny_disk: Path, tmp_path: Path) -> None:
    frames = list(np.random.default_rng(1).integers(0, 256, (6, 64, 64, 3), dtype=np.uint8))
    codes = frames[0]
    light = codes.astype(np.float16) / 255
    writers: dict[str, Callable[[Path], object]] = {
        "a.exr": partial(write_exr, linear=light, attributes={}),
        "a.png": partial(write_code_rows, bands=[codes], size=(64, 64)),
        "a.tif": partial(write_code_rows, bands=[codes], size=(64, 64)),
        "a.mp4": partial(encode, frames=frames, kind=H264, fps=8),
        "a.mkv": partial(encode, frames=frames, kind=FFV1, fps=8),
    }
    for name, write in writers.items():
        write(tmp_path / name)
        whole = (tmp_path / name).read_bytes()
        outcomes = set()
        for free in range(0, len(whole) + 16_384, 4096):
            (tiny_disk / "fill").write_bytes(bytes(TINY_BYTES - free))
            try:
                write(tiny_disk / name)
            except StoreFull:
                outcomes.add("refused")
                assert not (tiny_disk / name).exists()
            else:
                outcomes.add("whole")
                assert (tiny_disk / name).read_bytes() == whole
                (tiny_disk / name).unlink()
        assert outcomes == {"whole", "refused"}, name
