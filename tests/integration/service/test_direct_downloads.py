"""Downloads that bypass the service: from a real bucket, by a client that the service redirects there."""

from __future__ import annotations

import http.client
import os
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import httpx
import pytest

from lippmann.client import Client
from lippmann.digest import digest_of
from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order, TaskKind
from service.ports import Parts
from service.schemas.access import Role
from tests.broker import free_port
from tests.builders_service import SPEC, FakePictures, FakeScenes, claimed, done
from tests.integration.service.conftest import FakeWorker, Service
from tests.object_store import ObjectStore
from tests.object_store import object_store as object_store
from tests.waiting import ENOUGH_S, until
from worker.store.s3 import S3Store

VIDEO = "video/views.mp4"
DATA = os.urandom(3_000_000)


class _Gate(ThreadingHTTPServer):
    """A public address of the object store, which records what clients send and breaks off answers."""

    daemon_threads = True

    def __init__(self, store: ObjectStore) -> None:
        super().__init__(("127.0.0.1", 0), _Passing)
        self.store_port = store.port
        self.asked: list[dict[str, str]] = []
        self.break_offs: list[int] = []
        """The bytes after which the next answers break off."""

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"

    def handle_error(self, *_: object) -> None:
        """Say nothing: connections that break are what is tested."""


class _Passing(BaseHTTPRequestHandler):
    server: _Gate

    def do_GET(self) -> None:
        self.server.asked.append(dict(self.headers))
        upstream = http.client.HTTPConnection("127.0.0.1", self.server.store_port, timeout=ENOUGH_S)
        upstream.request("GET", self.path, headers=dict(self.headers))
        answer = upstream.getresponse()
        self.send_response(answer.status)
        for name, value in answer.getheaders():
            self.send_header(name, value)
        self.end_headers()
        after = self.server.break_offs.pop(0) if self.server.break_offs else None
        self.wfile.write(answer.read()[:after])
        upstream.close()

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@pytest.fixture
def gate(object_store: ObjectStore) -> Iterator[_Gate]:
    with _Gate(object_store) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        try:
            yield server
        finally:
            server.shutdown()
            thread.join()


@pytest.fixture
def make_store(object_store: ObjectStore, tmp_path: Path) -> Callable[[str], S3Store]:
    bucket = object_store.new_bucket()
    return lambda public: S3Store(
        bucket, copies=tmp_path / "copies", endpoint=object_store.endpoint, public_endpoint=public
    )


@pytest.fixture
def make_job(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker], make_store: Callable[[str], S3Store]
) -> Callable[[str], tuple[Service, S3Store, str]]:
    """Return a service with a public address of its store, the store, and a job whose video is made."""

    def make(public: str) -> tuple[Service, S3Store, str]:
        store = make_store(public)

        def answer(order: Order) -> list[Event]:
            if order.kind is not TaskKind.ENCODE:
                return [claimed(order), done(order)]
            store.put_bytes(f"{order.job_id}/{VIDEO}", DATA)
            return [claimed(order), done(order, digests={VIDEO: digest_of([DATA])})]

        service = make_service(Parts(store=store, pictures=FakePictures(), scenes=FakeScenes()))
        make_worker(answer)
        job_id = str(service.client.post("/jobs", json=SPEC | {"frames": "1"}).json()["id"])
        until(lambda: service.status(job_id) == "done")
        return service, store, job_id

    return make


@contextmanager
def client_of(service: Service) -> Iterator[Client]:
    with Client(service.url, service.new_key(Role.VIEWER), patience_s=ENOUGH_S) as client:
        yield client


def requests_of(store: S3Store) -> Counter[str]:
    """Return what counts the requests of a store for the video from now on, by their names."""
    counted: Counter[str] = Counter()

    def count(params: dict[str, Any], model: Any, **_: Any) -> None:
        if params.get("Key", "").endswith(VIDEO):
            counted[model.name] += 1

    store._client.meta.events.register("provide-client-params.s3", count)
    return counted


@pytest.mark.promise(
    "People", "A client that the service redirects to the bucket sends its key to the service, and to nobody else."
)
def test_a_client_downloads_from_the_bucket_and_sends_no_key_there(
    make_job: Callable[[str], Any], gate: _Gate, tmp_path: Path
) -> None:
    service, store, job_id = make_job(gate.url)
    counted = requests_of(store)
    with client_of(service) as client:
        download = client.download(job_id, VIDEO, tmp_path / "a.mp4")
    assert (download.path.read_bytes(), download.size) == (DATA, len(DATA))
    assert counted["GetObject"] == 0
    (asked,) = gate.asked
    assert {"Authorization", "Cookie"}.isdisjoint(asked)
    assert download.etag == service.client.head(f"/jobs/{job_id}/artifacts/{VIDEO}").headers["ETag"]


def test_a_direct_download_that_breaks_off_goes_on_where_it_was(
    make_job: Callable[[str], Any], gate: _Gate, tmp_path: Path
) -> None:
    service, _, job_id = make_job(gate.url)
    gate.break_offs = [1_000_000, 500_000]
    came: list[int] = []
    with client_of(service) as client:
        client.download(job_id, VIDEO, tmp_path / "a.mp4", on_bytes=came.append)
    assert (tmp_path / "a.mp4").read_bytes() == DATA
    assert sum(came) == len(DATA)
    assert [asked.get("Range") for asked in gate.asked] == [None, "bytes=1000000-", "bytes=1500000-"]


def test_a_file_that_is_damaged_in_the_bucket_is_made_again_and_comes_whole(
    make_job: Callable[[str], Any], gate: _Gate, tmp_path: Path
) -> None:
    service, store, job_id = make_job(gate.url)
    store.put_bytes(f"{job_id}/{VIDEO}", DATA[:-1] + bytes([DATA[-1] ^ 1]))
    with client_of(service) as client:
        download = client.download(job_id, VIDEO, tmp_path / "a.mp4")
        assert len(gate.asked) == 1
        assert download.path.read_bytes() == DATA
        assert download.etag.strip('"') == next(one.etag for one in client.artifacts(job_id) if one.name == VIDEO)
    assert store.get_bytes(f"{job_id}/{VIDEO}") == DATA
    assert [path.name for path in tmp_path.glob(".*.part")] == []


def test_where_the_bucket_cannot_be_reached_the_service_sends_the_file(
    make_job: Callable[[str], Any], tmp_path: Path
) -> None:
    service, store, job_id = make_job(f"http://127.0.0.1:{free_port()}")
    with client_of(service) as client:
        counted = requests_of(store)
        client.download(job_id, VIDEO, tmp_path / "a.mp4")
        assert (tmp_path / "a.mp4").read_bytes() == DATA
        # The first time, the service verifies the content before it sends it.
        assert counted == {"HeadObject": 4, "GetObject": 2}
        counted.clear()
        client.download(job_id, VIDEO, tmp_path / "b.mp4")
        assert (tmp_path / "b.mp4").read_bytes() == DATA
        # One for HEAD; one with one GET for the file: no second redirect is asked for.
        assert counted == {"HeadObject": 2, "GetObject": 1}


def test_only_who_asks_for_it_is_redirected_and_the_url_gives_one_file(
    make_job: Callable[[str], Any], object_store: ObjectStore
) -> None:
    service, store, job_id = make_job("")
    url, asks = f"/jobs/{job_id}/artifacts/{VIDEO}", {"Prefer": "redirect"}
    plain, head = service.client.get(url), service.client.head(url, headers=asks)
    assert (plain.status_code, plain.content, head.status_code) == (200, DATA, 200)
    assert plain.headers["Repr-Digest"] == head.headers["Repr-Digest"]
    answer = service.client.get(url, headers=asks)
    assert (answer.status_code, answer.content) == (307, b"")
    assert answer.headers["Location"].startswith(object_store.endpoint)
    assert (answer.headers["Cache-Control"], answer.headers["Preference-Applied"]) == ("no-store", "redirect")
    with httpx.Client() as anybody:
        found = anybody.get(answer.headers["Location"])
        assert (found.content, found.headers["ETag"]) == (DATA, plain.headers["ETag"])
        for name in ("Content-Disposition", "Content-Type"):
            assert found.headers[name] == plain.headers[name]
        other = answer.headers["Location"].replace("views.mp4?", "views.json?")
        assert anybody.get(other).status_code == 403
    etag = plain.headers["ETag"]
    assert service.client.get(url, headers=asks | {"If-None-Match": etag}).status_code == 304
    assert service.client.get(url, headers=asks | {"Range": f"bytes={len(DATA)}-"}).status_code == 416
    # The digest of a job's own files is not known, so nobody could verify them.
    assert service.client.get(f"/jobs/{job_id}/artifacts/job.json", headers=asks).status_code == 200
    assert service.client.get(f"/jobs/{job_id}/artifacts/nothing.mp4", headers=asks).status_code == 404
    with httpx.Client(base_url=service.url) as nobody:
        assert nobody.get(f"/api/v1{url}", headers=asks).status_code == 401
    assert store.get_bytes(f"{job_id}/{VIDEO}") == DATA
