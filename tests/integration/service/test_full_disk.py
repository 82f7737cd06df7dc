"""The disks of the database and of the broker run full: actions work, health says it, and it goes on by itself."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import redis

from lippmann.farm.supervisor.broker import find_server, server_command
from service.broker_stream import Stream
from tests.builders_messages import SEALS
from tests.builders_service import SPEC, claimed
from tests.disks import Disk, small_disk
from tests.integration.service.conftest import FakeWorker, Service
from tests.waiting import ENOUGH_S, until

DATABASE_FULL = "The disk of the database has no room left."


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Disk]:
    with small_disk(tmp_path / "disk", mb=24) as disk:
        yield disk


def _health(service: Service) -> dict[str, Any]:
    return dict(service.client.get("/health").json())


def test_jobs_are_paused_cancelled_and_removed_though_the_disk_of_the_database_is_full(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker], disk: Disk
) -> None:
    service = make_service(data_dir=disk.path, database_reserve_mb=4.0, store_check_s=0.5)
    make_worker(lambda order: [claimed(order)], data_dir=disk.path)
    waiting, old = (service.client.post("/jobs", json=SPEC).json()["id"] for _ in range(2))
    until(lambda: service.status(waiting) == service.status(old) == "probing")
    assert service.client.post(f"/jobs/{old}/cancel").status_code == 200
    disk.fill()
    until(lambda: service.status(waiting) == "paused")
    job = service.client.get(f"/jobs/{waiting}").json()
    assert (job["pause"]["by"], job["pause"]["code"], job["pause"]["reason"]) == (
        "farm",
        "database-full",
        DATABASE_FULL,
    )
    health = _health(service)
    assert (health["status"], health["database"]["ok"], health["database"]["detail"]) == (
        "degraded", False, DATABASE_FULL,
    )  # fmt: skip
    assert health["coordinator"]["ok"], "the leader is renewed in the reserve"
    refused = service.client.post("/jobs", json=SPEC)
    assert (refused.status_code, refused.json()["code"]) == (507, "store-full")
    assert service.client.delete(f"/jobs/{old}").status_code == 204
    assert service.client.post(f"/jobs/{waiting}/resume").status_code == 200
    until(lambda: service.status(waiting) == "paused")
    disk.free()
    until(lambda: service.status(waiting) in ("probing", "running"))
    assert until(lambda: _health(service)["status"] == "ok")
    assert service.client.post("/jobs", json=SPEC).status_code == 201


def test_a_broker_that_cannot_write_its_file_is_told_from_one_that_can(disk: Disk, tmp_path: Path) -> None:
    socket = tmp_path / "b.sock"
    command = server_command(find_server(), socket=socket, folder=disk.path)
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as server:
        try:
            url = f"unix://{socket}"
            client = redis.Redis.from_url(url, protocol=2, socket_timeout=ENOUGH_S)
            until(lambda: _is_written(client))
            stream = Stream(url, seals=SEALS, timeout_s=ENOUGH_S)
            assert stream.write_error() is None
            disk.fill()
            until(lambda: not _is_written(client))
            assert stream.write_error() == "Errors writing to the AOF file: No space left on device"
            disk.free()
            until(lambda: stream.write_error() is None)
            assert _is_written(client)
        finally:
            server.kill()


def _is_written(client: Any) -> bool:
    try:
        return bool(client.set("key", b"x" * 100_000))
    except redis.RedisError:
        return False
