"""Connections of clients that mean harm, or are very slow: honest requests are served meanwhile."""

from __future__ import annotations

import json
import os
import resource
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import httpx
import pytest

from lippmann.plan.artifact_names import job_artifact
from service.connections import HEAD_BYTES
from service.schemas.access import Role
from tests.broker import Broker
from tests.builders_service import SPEC
from tests.farm import LIPPMANN, admin_key
from tests.integration.service.conftest import Service
from tests.minutes import stop_minutes
from tests.waiting import ENOUGH_S, until

HALF = b"POST /api/v1/jobs HTTP/1.1\r\nHost: x\r\nContent-Le"
DESCRIPTORS = 1024
HALF_REQUESTS = 1200
LARGE = 30_000_000
"""The size of a file that no buffer between the service and a client holds, in bytes."""


def connect(url: str) -> socket.socket:
    host, port = url.removeprefix("http://").split(":")
    return socket.create_connection((host, int(port)), timeout=ENOUGH_S)


def answer(connection: socket.socket) -> bytes:
    """Return what the service sends until it closes the connection."""
    return b"".join(iter(lambda: connection.recv(65_536), b""))


@pytest.fixture
def small_server(tmp_path: Path, broker: Broker) -> Iterator[tuple[str, str]]:
    """Lend the URL and an admin key of a service that has 1,024 descriptors and may not raise the limit."""
    key_file = tmp_path / "admin.key"
    command = [LIPPMANN, "serve", "--json", "--port", "0", "--key-file", str(key_file)]
    env = {**os.environ, "LIPPMANN_REDIS_URL": broker.url, "LIPPMANN_DATA_DIR": str(tmp_path)}
    process = subprocess.Popen(
        command, env=env, stdout=subprocess.PIPE, text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (DESCRIPTORS, DESCRIPTORS)),
    )  # fmt: skip
    try:
        assert process.stdout is not None
        url = json.loads(process.stdout.readline())["url"]
        key = admin_key(key_file)
        yield url, key
        assert process.poll() is None
    finally:
        process.terminate()
        process.wait(ENOUGH_S)
        process.stdout.close()  # type: ignore[union-attr]


@pytest.mark.promise(
    "Before login", "Half requests do not keep honest requests, the coordinator or the database from working."
)
def test_honest_requests_are_served_while_1200_half_requests_hang(small_server: tuple[str, str]) -> None:
    url, key = small_server
    headers = {"Authorization": f"Bearer {key}"}
    with ExitStack() as stack:
        until(lambda: httpx.get(f"{url}/api/v1/health", timeout=ENOUGH_S).json()["coordinator"]["ok"])
        for _ in range(HALF_REQUESTS):
            connection = stack.enter_context(connect(url))
            connection.sendall(HALF)
        for number in range(5):
            spec = {"scene": "fish", "frames": "1", "title": str(number)}
            made = httpx.post(f"{url}/api/v1/jobs", json=spec, headers=headers, timeout=ENOUGH_S)
            assert made.status_code == 201, made.text
            health = httpx.get(f"{url}/api/v1/health", headers=headers, timeout=ENOUGH_S).json()
            assert [health[part]["ok"] for part in ("database", "broker", "store", "coordinator")] == [True] * 4


@pytest.mark.promise("Before login", "Headers and bodies that do not arrive end with 408.")
def test_headers_and_bodies_that_do_not_arrive_are_answered_with_408(make_service: Callable[..., Service]) -> None:
    service = make_service(request_headers_s=1.0, request_body_s=1.0)
    form = b"Content-Type: application/x-www-form-urlencoded\r\nContent-Length: 50\r\n\r\n"
    head = b"POST /login HTTP/1.1\r\nHost: x\r\n" + form
    with connect(service.url) as silent, connect(service.url) as headers, connect(service.url) as body:
        headers.sendall(HALF)
        body.sendall(head + b"key=lm")
        assert [answer(one).split(b"\r\n")[0] for one in (silent, headers, body)] == [
            b"HTTP/1.1 408 Request Timeout"
        ] * 3


def test_a_body_that_arrives_slowly_but_steadily_is_read(make_service: Callable[..., Service]) -> None:
    service = make_service(request_body_s=1.0)
    part = b" " * 60_000
    begun_s = time.monotonic()

    def parts() -> Iterator[bytes]:
        yield json.dumps(SPEC | {"frames": "1"}).encode()
        while time.monotonic() - begun_s < 2.5:
            yield part
            time.sleep(0.1)

    made = service.client.post("/jobs", content=parts(), headers={"Content-Type": "application/json"})
    assert made.status_code == 201, made.text


@pytest.mark.promise("Before login", "Headers have a largest size.")
def test_endless_headers_are_refused(service: Service) -> None:
    with connect(service.url) as connection:
        connection.sendall(b"GET / HTTP/1.1\r\nX: " + b"a" * (HEAD_BYTES + 1))
        assert answer(connection).startswith(b"HTTP/1.1 431 ")


def test_an_address_with_too_many_connections_loses_its_oldest_idle_one(make_service: Callable[..., Service]) -> None:
    service = make_service(connections_per_address=3)
    with ExitStack() as stack:
        first, *others = [stack.enter_context(connect(service.url)) for _ in range(4)]
        with suppress(ConnectionResetError):
            assert answer(first) == b""
        for one in others:
            one.sendall(b"GET /api/v1/health HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
            assert answer(one).startswith(b"HTTP/1.1 200")
    assert service.server.guard.closed == 1


def test_requests_that_cannot_be_parsed_do_not_fill_the_log(service: Service, caplog: pytest.LogCaptureFixture) -> None:
    for _ in range(3):
        with connect(service.url) as connection:
            connection.sendall(b"GGG")
            assert answer(connection).startswith(b"HTTP/1.1 400 ")
    assert sum("Invalid HTTP request" in record.message for record in caplog.records) <= 1


@pytest.fixture
def large_file(make_service: Callable[..., Service], monkeypatch: pytest.MonkeyPatch) -> tuple[Service, bytes]:
    """Return a service that waits a second for its clients to read, and a request for a file of 30 MB."""
    monkeypatch.setattr("service.connections.STALLED_S", 1.0)
    service = make_service()
    job_id = service.client.post("/jobs", json=SPEC).json()["id"]
    service.parts.store.put_bytes(job_artifact(job_id, "video/large.mp4"), bytes(LARGE))
    key = service.client.headers["Authorization"]
    head = f"GET /api/v1/jobs/{job_id}/artifacts/video/large.mp4 HTTP/1.1\r\nHost: x\r\nAuthorization: {key}\r\n"
    return service, f"{head}Connection: close\r\n\r\n".encode()


@pytest.mark.promise("People", "A client that does not read its answer loses its connection.")
def test_a_client_that_does_not_read_its_answer_loses_its_connection(large_file: tuple[Service, bytes]) -> None:
    service, request = large_file
    before = set(service.server.server_state.connections)
    with connect(service.url) as connection:
        connection.sendall(request)
        (held,) = until(lambda: set(service.server.server_state.connections) - before)
        until(lambda: held not in service.server.server_state.connections)
        assert len(answer(connection)) < LARGE


def test_a_client_that_reads_slowly_gets_its_whole_answer(large_file: tuple[Service, bytes]) -> None:
    service, request = large_file
    received, ended_s = 0, time.monotonic() + 2.5
    with connect(service.url) as connection:
        connection.sendall(request)
        while time.monotonic() < ended_s:
            received += len(connection.recv(100_000))
            time.sleep(0.02)
        received += len(answer(connection))
    assert received > LARGE


@pytest.mark.promise("Before login", "Only a trusted proxy can say whose request it is.")
def test_only_a_trusted_proxy_can_say_whose_request_it_is(
    make_service: Callable[..., Service], monkeypatch: pytest.MonkeyPatch
) -> None:
    stop_minutes(monkeypatch)

    def statuses(service: Service) -> list[int]:
        named = [{"X-Forwarded-For": f"192.0.2.{number}"} for number in range(4)]
        return [service.client.get("/health", headers=headers).status_code for headers in named]

    assert statuses(make_service(requests_per_minute_by_address=2)) == [200, 200, 429, 429]
    proxied = make_service(requests_per_minute_by_address=2, trusted_proxies="192.0.2.0/28, 127.0.0.1")
    assert statuses(proxied) == [200] * 4


@pytest.mark.promise("People", "The event streams of a key are limited.")
def test_the_event_streams_of_one_key_are_capped(make_service: Callable[..., Service]) -> None:
    service = make_service(streams_per_key=2)
    other = {"Authorization": f"Bearer {service.new_key(Role.VIEWER)}"}
    with ExitStack() as stack:

        def listen(**more: Any) -> httpx.Response:
            return stack.enter_context(service.client.stream("GET", "/events", **more))

        assert [listen().status_code for _ in range(3)] == [200, 200, 429]
        assert listen().headers["Retry-After"]
        assert listen(headers=other).status_code == 200
    until(lambda: _status_of_a_stream(service) == 200)


def _status_of_a_stream(service: Service) -> int:
    with service.client.stream("GET", "/events") as stream:
        return stream.status_code
