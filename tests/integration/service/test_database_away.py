"""A PostgreSQL that refuses connections for a while, as one that fails over does."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import pytest
from sqlalchemy.engine import make_url

from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order, TaskKind
from tests.builders_service import SPEC, claimed, done
from tests.integration.service.conftest import FakeWorker, Service
from tests.tcp_proxy import TcpProxy, tcp_proxy
from tests.waiting import ENOUGH_S, until

AWAY_S = 3.0
"""Longer than the leader's time in these tests."""


@pytest.fixture
def proxied(postgresql_url: str) -> Iterator[tuple[str, TcpProxy]]:
    """Lend the URL of a database behind a proxy, and the proxy."""
    url = make_url(postgresql_url)
    assert url.host
    assert url.port
    with tcp_proxy((url.host, url.port)) as proxy:
        assert isinstance(proxy.address, tuple)
        yield url.set(port=proxy.address[1]).render_as_string(hide_password=False), proxy


def test_while_the_database_is_away_requests_are_told_to_come_again_and_then_the_job_ends_with_each_frame_once(
    make_service: Callable[..., Service], make_worker: Callable[..., FakeWorker], proxied: tuple[str, TcpProxy]
) -> None:
    url, proxy = proxied
    service = make_service(database_url=url, leader_ttl_s=1.0)
    frames, is_away = 6, threading.Event()

    def answer(order: Order) -> list[Event]:
        if order.kind is TaskKind.ASSEMBLE and order.frame == 3 and not is_away.is_set():
            proxy.refuse()
            is_away.set()
        return [claimed(order), done(order)]  # What a worker reports meanwhile waits in the broker.

    make_worker(answer)
    job_id = str(service.client.post("/jobs", json=SPEC | {"frames": f"1-{frames}"}).json()["id"])
    assert is_away.wait(ENOUGH_S)
    back_s = time.monotonic() + AWAY_S
    while time.monotonic() < back_s:
        for answered in (service.client.get(f"/jobs/{job_id}"), service.client.post("/jobs", json=SPEC)):
            assert (answered.status_code, answered.json()["code"]) == (503, "database-unavailable")
            assert int(answered.headers["Retry-After"]) > 0
        health = service.client.get("/health").json()
        assert (health["status"], health["database"]["ok"]) == ("degraded", False)
    proxy.pass_on()
    until(lambda: service.client.get(f"/jobs/{job_id}").is_success and service.status(job_id) == "done")
    job = service.client.get(f"/jobs/{job_id}").json()
    assert (job["frames_done"], job["frames_total"]) == (frames, frames)
    tasks = service.client.get(f"/jobs/{job_id}/tasks", params={"limit": 100}).json()["items"]
    assert {(task["status"], task["failures"]) for task in tasks} == {("done", 0)}
    until(lambda: service.client.get("/health").json()["status"] == "ok")
