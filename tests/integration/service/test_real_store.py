"""The service over the store that one machine really has."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from service.ports import Parts
from tests.builders_service import SPEC, FakePictures, FakeScenes
from tests.integration.service.conftest import FakeWorker, Service
from tests.waiting import until
from worker.store.local import LocalStore

DATA = bytes(range(256)) * 1000


@pytest.fixture
def store(tmp_path: Path) -> LocalStore:
    return LocalStore(tmp_path / "artifacts")


@pytest.fixture
def service(make_service: Callable[..., Service], store: LocalStore) -> Service:
    return make_service(Parts(store=store, pictures=FakePictures(), scenes=FakeScenes()))


def test_artifacts_are_listed_fetched_in_part_and_removed_with_their_job(
    service: Service, store: LocalStore, make_worker: Callable[..., FakeWorker], tmp_path: Path
) -> None:
    make_worker()
    job_id = str(service.client.post("/jobs", json=SPEC).json()["id"])
    until(lambda: service.status(job_id) == "done")
    store.put_bytes(f"{job_id}/video/views.mp4", DATA)
    store.put_bytes(f"{job_id}/integral/0001.exr", DATA)

    def names(**query: str) -> list[str]:
        page = service.client.get(f"/jobs/{job_id}/artifacts", params=query).json()
        return [item["name"] for item in page["items"]]

    assert names() == ["integral/0001.exr", "job.json", "plan.json", "video/views.mp4"]
    assert names(prefix="video/") == names(prefix="video") == ["video/views.mp4"]
    assert names(prefix="nothing/") == []
    url = f"/jobs/{job_id}/artifacts/video/views.mp4"
    part = service.client.get(url, headers={"Range": "bytes=100000-"})
    assert (part.status_code, part.content) == (206, DATA[100_000:])
    whole = service.client.get(url)
    assert whole.content == DATA
    assert service.client.get(url, headers={"If-None-Match": whole.headers["ETag"]}).status_code == 304
    png = service.client.get(f"/jobs/{job_id}/artifacts/integral/0001.exr", params={"format": "png"})
    assert png.content == b"png of 0001.exr, 8 bits"
    for wrong in ("nothing.exr", "video", "%2e%2e/%2e%2e/x", "a%01b", "x" * 300):
        assert service.client.get(f"/jobs/{job_id}/artifacts/{wrong}").status_code == 404, wrong
    assert service.client.delete(f"/jobs/{job_id}").status_code == 204
    until(lambda: not (tmp_path / "artifacts" / job_id).exists())


def test_a_service_that_starts_without_its_disk_waits_for_it_and_says_so(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker], tmp_path: Path
) -> None:
    root, disk = tmp_path / "artifacts", tmp_path / "disk"

    def start() -> Service:
        return make_service(Parts(LocalStore(root), FakePictures(), FakeScenes()), store_check_s=0.2)

    make_worker()
    first = start()
    job_id = str(first.client.post("/jobs", json=SPEC).json()["id"])
    until(lambda: first.status(job_id) == "done")
    first.stop()
    root.rename(disk)
    service = start()
    until(lambda: service.client.get("/health").json()["faults"])
    health = service.client.get("/health").json()
    message = "The artifact store cannot be written: the folder in its place has no id."
    assert (health["status"], health["store"]["ok"], health["store"]["detail"]) == ("degraded", False, message)
    url = f"/jobs/{job_id}/artifacts/plan.json"
    assert service.client.get(url).json()["code"] == "store-unavailable"
    assert service.client.post("/jobs", json=SPEC).json()["code"] == "store-unavailable"
    assert (service.status(job_id), [*root.iterdir()]) == ("done", [root / ".partial"])
    (root / ".partial").rmdir()
    root.rmdir()
    disk.rename(root)
    until(lambda: service.client.get("/health").json()["status"] == "ok")
    assert service.client.get(url).status_code == 200
    again = str(service.client.post("/jobs", json=SPEC).json()["id"])
    until(lambda: service.status(again) == "done")
