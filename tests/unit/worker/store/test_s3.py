"""A bucket as a store: its errors, its uploads, connections that break, other processes."""

from __future__ import annotations

import datetime
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import botocore.auth
import httpx
import pytest
from boto3.s3.transfer import TransferConfig

from lippmann.errors import ArtifactMissing, DiskFull, StoreUnavailable
from tests.broker import free_port
from tests.object_store import ObjectStore
from tests.unit.worker.store.conftest import TINY_BYTES
from tests.waiting import ENOUGH_S
from worker.store import s3
from worker.store.s3 import IDENTITY, S3Store


@pytest.fixture
def bucket(object_store: ObjectStore) -> str:
    return object_store.new_bucket()


@pytest.fixture
def copies(tmp_path: Path) -> Path:
    return tmp_path / "copies"


@pytest.fixture
def make_store(object_store: ObjectStore, bucket: str, copies: Path) -> Callable[..., S3Store]:
    """Open the bucket, or another one, at the server or elsewhere."""
    return lambda **change: S3Store(**{"bucket": bucket, "copies": copies, "endpoint": object_store.endpoint, **change})


@pytest.fixture
def store(make_store: Callable[..., S3Store]) -> S3Store:
    return make_store()


def test_of_several_processes_one_makes_the_id(make_store: Callable[..., S3Store]) -> None:
    assert make_store().identity() is None
    with ThreadPoolExecutor(8) as pool:
        (made,) = {*pool.map(lambda _: make_store().make_identity(), range(8))}
    assert make_store().identity() == made


def test_the_store_of_another_farm_is_unavailable_and_its_artifacts_are_not_missing(store: S3Store) -> None:
    store.make_identity()
    store.put_bytes("job/a", b"mine")
    store.expect("0" * 32)
    for ask in (
        lambda: store.put_bytes("job/a", b"new"),
        lambda: store.exists("job/none"),
        lambda: store.list("job"),
        lambda: store.delete("job"),
        lambda: store.folders(),
    ):
        with pytest.raises(StoreUnavailable, match=f"{store.place} is another store"):
            ask()
    assert store.get_bytes("job/a") == b"mine"


def test_a_store_without_its_id_is_unavailable(store: S3Store, object_store: ObjectStore, bucket: str) -> None:
    store.expect(store.make_identity())
    object_store.client().delete_object(Bucket=bucket, Key=IDENTITY)
    with pytest.raises(StoreUnavailable, match=f"{store.place} has no id"):
        store.put_bytes("a", b"")


def test_a_bucket_holds_several_stores(make_store: Callable[..., S3Store]) -> None:
    one, two = (make_store(prefix=name) for name in ("farms/one", "farms/one-b"))
    one.put_bytes("job/a", b"1")
    two.put_bytes("job/b", b"2")
    assert one.make_identity() != two.make_identity()
    assert ([info.name for info in one.list("")], one.folders()) == (["job/a"], ["job"])
    one.delete("job")
    assert [info.name for info in two.list("")] == ["job/b"]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"AWS_ACCESS_KEY_ID": "nobody"}, "the server does not know the access key"),
        ({"AWS_SECRET_ACCESS_KEY": "wrong"}, "the secret key is not that of the access key"),
        ({"AWS_ACCESS_KEY_ID": "", "AWS_SECRET_ACCESS_KEY": "", "HOME": "/nowhere"}, "there is no access key"),
    ],
)
def test_a_wrong_key_is_named(
    make_store: Callable[..., S3Store], monkeypatch: pytest.MonkeyPatch, change: dict[str, str], reason: str
) -> None:
    for name, value in change.items():
        monkeypatch.setenv(name, value) if value else monkeypatch.delenv(name)
    store = make_store()
    for ask in (store.make_identity, lambda: store.put_bytes("a", b""), lambda: store.get_bytes("a")):
        with pytest.raises(StoreUnavailable, match=reason) as caught:
            ask()
        assert "wrong" not in str(caught.value)


def test_a_wrong_bucket_is_unavailable_and_nothing_in_it_is_missing(make_store: Callable[..., S3Store]) -> None:
    store = make_store(bucket="no-such-bucket")
    for ask in (
        store.identity,
        store.make_identity,
        lambda: store.put_bytes("a", b""),
        lambda: store.get_bytes("a"),
        lambda: store.exists("a"),
        lambda: store.list("a"),
        lambda: store.read_range("a", 0, 1),
    ):
        with pytest.raises(StoreUnavailable, match=r"no-such-bucket at .* no bucket of this name"):
            ask()


def test_a_clock_that_is_wrong_is_named(store: S3Store, monkeypatch: pytest.MonkeyPatch) -> None:
    store.put_bytes("a", b"")
    now = botocore.auth.get_current_datetime
    monkeypatch.setattr(
        botocore.auth, "get_current_datetime", lambda *a, **k: now(*a, **k) - datetime.timedelta(hours=2)
    )
    with pytest.raises(StoreUnavailable, match="the clock of this machine differs from that of the server"):
        store.put_bytes("a", b"")


def test_a_server_that_is_away_is_unavailable(make_store: Callable[..., S3Store]) -> None:
    store = make_store(endpoint=f"http://127.0.0.1:{free_port()}", attempts=1)
    for ask in (lambda: store.put_bytes("a", b""), lambda: store.get_bytes("a"), lambda: store.exists("a")):
        with pytest.raises(StoreUnavailable, match="the server does not answer"):
            ask()


def test_a_large_file_is_stored_in_parts_and_whole(
    store: S3Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(s3, "PART_BYTES", 5 << 20)
    monkeypatch.setattr(
        s3, "_IN_PARTS", TransferConfig(multipart_threshold=5 << 20, multipart_chunksize=5 << 20, max_concurrency=2)
    )
    data = os.urandom(11 << 20)
    (tmp_path / "large").write_bytes(data)
    store.put_file("job/large", tmp_path / "large")
    assert store.etag("job/large").endswith("-3")
    assert store.get_bytes("job/large") == data
    store.link("job/large", "job/second")
    with store.local_path("job/second") as path:
        assert path.read_bytes() == data
    assert not path.exists()


MEASURING = """
import sys
from pathlib import Path
from boto3.s3.transfer import TransferConfig
from worker.store import s3
s3.PART_BYTES = 5 << 20
s3._IN_PARTS = TransferConfig(multipart_threshold=5 << 20, multipart_chunksize=5 << 20, max_concurrency=4)
def peak_kib():
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith("VmHWM"))
store = s3.S3Store(sys.argv[1], copies=Path(sys.argv[3] + "-copies"), endpoint=sys.argv[2])
store.put_bytes("job/small", b"1")
before_kib = peak_kib()
store.put_file("job/large", Path(sys.argv[3]))
print(peak_kib() - before_kib)
"""


def test_a_large_file_is_sent_without_being_in_memory(
    store: S3Store, object_store: ObjectStore, bucket: str, tmp_path: Path
) -> None:
    with (tmp_path / "large").open("wb") as file:
        file.truncate(100 << 20)
    command = [sys.executable, "-c", MEASURING, bucket, object_store.endpoint, str(tmp_path / "large")]
    measured = subprocess.run(command, capture_output=True, check=True, timeout=ENOUGH_S)
    assert store.size("job/large") == 100 << 20
    assert int(measured.stdout) < 25 << 10, "the parts that wait have 50 MiB"


def test_an_error_while_parts_are_sent_is_named(
    make_store: Callable[..., S3Store], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(s3, "PART_BYTES", 1)
    monkeypatch.setattr(s3, "_IN_PARTS", TransferConfig(multipart_threshold=1, max_concurrency=2))
    (tmp_path / "large").write_bytes(b"data")
    with pytest.raises(StoreUnavailable, match=r"no-such-bucket at .* no bucket of this name"):
        make_store(bucket="no-such-bucket").put_file("job/large", tmp_path / "large")


UPLOADING = """
import os, signal, sys
from pathlib import Path
from boto3.s3.transfer import TransferConfig
from worker.store import s3
s3.PART_BYTES = 5 << 20
s3._IN_PARTS = TransferConfig(multipart_threshold=5 << 20, multipart_chunksize=5 << 20, use_threads=False)
class Dying(s3.S3Store):
    @property
    def _client(self):
        client = super()._client
        def die(params, **_):
            if params["url"].find("partNumber=2") >= 0: os.kill(os.getpid(), signal.SIGKILL)
        client.meta.events.register("before-call.s3.UploadPart", die)
        return client
Dying(sys.argv[1], copies=Path(sys.argv[3] + "-copies"), endpoint=sys.argv[2]).put_file("job/large", Path(sys.argv[3]))
"""


def test_an_upload_of_a_killed_process_is_invisible_and_swept(
    store: S3Store, object_store: ObjectStore, bucket: str, tmp_path: Path
) -> None:
    (tmp_path / "large").write_bytes(os.urandom(11 << 20))
    command = [sys.executable, "-c", UPLOADING, bucket, object_store.endpoint, str(tmp_path / "large")]
    assert subprocess.run(command, timeout=300).returncode == -9
    assert not store.exists("job/large")
    assert store.list("") == []
    assert (store.count_partial(3600), store.sweep(3600)) == (0, 0)
    assert (store.count_partial(-60), store.sweep(-60)) == (1, 1)
    assert store.count_partial(-60) == 0


class _Breaking:
    """An answer whose connection breaks after some bytes."""

    def __init__(self, body: Any, after: int) -> None:
        self._body, self._left = body, after

    def read(self, size: int) -> bytes:
        if self._left <= 0:
            raise ConnectionResetError
        data = bytes(self._body.read(min(self._left, size)))
        self._left -= len(data)
        return data

    def close(self) -> None:
        self._body.close()


def _break_answers(store: S3Store, number: int, after: int) -> None:
    """Break the first answers of a client."""
    left = [number]

    def broken(parsed: dict[str, Any], **_: Any) -> None:
        if left[0] and "Body" in parsed:
            left[0] -= 1
            parsed["Body"] = _Breaking(parsed["Body"], after)

    store._client.meta.events.register("after-call.s3.GetObject", broken)


def test_a_connection_that_breaks_loses_no_byte(store: S3Store) -> None:
    data = os.urandom(1 << 20)
    store.put_bytes("a", data)
    _break_answers(store, 3, 300_000)
    assert b"".join(store.read_range("a", 7, len(data))) == data[7:]
    _break_answers(store, 1, 300_000)
    assert store.get_bytes("a") == data


def test_a_connection_that_breaks_while_the_artifact_is_replaced_is_an_error(store: S3Store) -> None:
    store.put_bytes("a", b"o" * 600_000)
    _break_answers(store, 1, 300_000)
    chunks = store.read_range("a", 0, 600_000)
    next(chunks)
    store.put_bytes("a", b"n" * 600_000)
    with pytest.raises(StoreUnavailable):
        list(chunks)


def test_connections_that_always_break_are_an_error(store: S3Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(s3, "_pause_s", lambda attempt: 0.0)
    store.put_bytes("a", b"o" * 600_000)
    _break_answers(store, 1000, 0)
    with pytest.raises(StoreUnavailable, match="connection failed"):
        store.get_bytes("a")
    with pytest.raises(StoreUnavailable, match="connection failed"):
        list(store.read_range("a", 0, 600_000))


def test_a_fork_has_connections_of_its_own(store: S3Store) -> None:
    store.put_bytes("a", b"parent")
    fork = multiprocessing.get_context("fork")
    children = [fork.Process(target=_put_and_get, args=(store, number)) for number in range(4)]
    for child in children:
        child.start()
    assert [store.get_bytes("a") for _ in range(20)] == [b"parent"] * 20
    for child in children:
        child.join(ENOUGH_S)
    assert [child.exitcode for child in children] == [0, 0, 0, 0]


def _put_and_get(store: S3Store, number: int) -> None:
    for data in (os.urandom(1000) for _ in range(10)):
        store.put_bytes(f"job/{number}", data)
        assert store.get_bytes(f"job/{number}") == data


def test_a_thousand_objects_and_more_are_listed_and_deleted(store: S3Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(s3, "DELETED_AT_ONCE", 7)
    names = [f"job/{number:02}" for number in range(20)]
    for name in (*names, "jobs"):
        store.put_bytes(name, b"")
    client = store._client
    client.meta.events.register("before-parameter-build.s3.ListObjectsV2", lambda params, **_: params.update(MaxKeys=6))
    assert [info.name for info in store.list("job")] == names
    store._is_sorted = True  # How Amazon's server is read; these names have the same order on both.
    assert [info.name for info in store.list("job")] == names
    assert [info.name for info in store.list("job", after="job/03", limit=9)] == names[4:13]
    store.delete("job")
    assert [info.name for info in store.list("")] == ["jobs"]


def test_a_bucket_that_is_deleted_has_no_missing_artifacts(
    store: S3Store, object_store: ObjectStore, bucket: str
) -> None:
    store.expect(store.make_identity())
    store.put_bytes("a", b"1")
    admin = object_store.client()
    for key in ("a", IDENTITY):
        admin.delete_object(Bucket=bucket, Key=key)
    admin.delete_bucket(Bucket=bucket)
    # The id was read a moment ago.
    for ask in (lambda: store.exists("a"), lambda: store.get_bytes("a"), lambda: store.size("a")):
        with pytest.raises(StoreUnavailable, match="no bucket of this name"):
            ask()


def test_a_folder_of_a_console_is_no_artifact(make_store: Callable[..., S3Store], object_store: ObjectStore) -> None:
    store = make_store(prefix="farm")
    for key in ("farm/", "farm/job/"):
        object_store.client().put_object(Bucket=store._bucket, Key=key, Body=b"")
    store.put_bytes("job/a", b"")
    for is_sorted in (False, True):
        store._is_sorted = is_sorted
        assert [info.name for info in store.list("")] == ["job/a"]


COPYING = """
import os, signal, sys
from pathlib import Path
from worker.store.s3 import S3Store
with S3Store(sys.argv[1], copies=Path(sys.argv[3]), endpoint=sys.argv[2]).local_path("a"):
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_copies_of_a_killed_process_are_removed_and_those_of_a_living_one_stay(
    store: S3Store, make_store: Callable[..., S3Store], object_store: ObjectStore, bucket: str, copies: Path
) -> None:
    store.put_bytes("a", b"data")
    command = [sys.executable, "-c", COPYING, bucket, object_store.endpoint, str(copies)]
    assert subprocess.run(command, timeout=300).returncode == -9
    with store.local_path("a") as path:
        assert len(list(copies.iterdir())) == 2
        for folder in copies.iterdir():
            os.utime(folder, (0, 0))
        make_store()
        assert [path.parent] == list(copies.iterdir())
        assert path.read_bytes() == b"data"
    assert list(copies.iterdir()) == []


def test_a_full_disk_has_no_room_for_a_copy(
    store: S3Store, tiny_disk: Path, make_store: Callable[..., S3Store]
) -> None:
    store.put_bytes("a", os.urandom(2 * TINY_BYTES))
    with (
        pytest.raises(DiskFull, match=f"no room for a copy of a in {tiny_disk}"),
        make_store(copies=tiny_disk / "copies").local_path("a"),
    ):
        pass


def test_an_artifact_that_is_missing_is_named(store: S3Store) -> None:
    with pytest.raises(ArtifactMissing, match="expected the artifact job/none, got nothing there"):
        store.get_bytes("job/none")


def test_a_url_gives_one_artifact_to_anybody_until_it_expires(
    make_store: Callable[..., S3Store], monkeypatch: pytest.MonkeyPatch
) -> None:
    store, data = make_store(prefix="farm"), bytes(range(256))
    store.put_bytes("job/a.mp4", data)

    def url(**change: Any) -> str:
        headers = {"disposition": 'attachment; filename="job-a.mp4"', "media_type": "video/mp4"}
        return store.download_url("job/a.mp4", valid_s=300, **headers | change)

    answer = httpx.get(url())
    assert (answer.content, answer.headers["ETag"]) == (data, f'"{store.etag("job/a.mp4")}"')
    assert answer.headers["Content-Disposition"] == 'attachment; filename="job-a.mp4"'
    assert answer.headers["Content-Type"] == "video/mp4"
    part = httpx.get(url(), headers={"Range": "bytes=250-", "If-Match": answer.headers["ETag"]})
    assert (part.status_code, part.content) == (206, data[250:])
    assert httpx.get(url(), headers={"If-Match": '"other"'}).status_code == 412
    for wrong in (url().replace("a.mp4?", "b.mp4?"), url().replace("video%2Fmp4", "text%2Fhtml"), url()[:-1] + "~"):
        assert httpx.get(wrong).status_code == 403
    now = botocore.auth.get_current_datetime
    earlier = datetime.timedelta(seconds=310)
    monkeypatch.setattr(botocore.auth, "get_current_datetime", lambda *a, **k: now(*a, **k) - earlier)
    assert httpx.get(url()).status_code == 403


def test_urls_name_the_address_of_the_server_that_users_reach(make_store: Callable[..., S3Store]) -> None:
    store = make_store(public_endpoint="https://s3.example:8333")
    url = httpx.URL(store.download_url("a", valid_s=60, disposition="inline", media_type="text/plain"))
    assert (url.scheme, url.port, url.host.endswith("s3.example")) == ("https", 8333, True)
    assert url.params["X-Amz-Algorithm"] == "AWS4-HMAC-SHA256"
    assert "the-secret" not in str(url)
