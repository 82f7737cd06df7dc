"""Server-sent events: in order, once each, also after a break."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import httpx

from service.db import events as event_rows
from service.events.subscription import QUEUE_BYTES
from service.schemas.access import Role
from service.schemas.events import EventTopic
from tests.broker import Broker
from tests.builders_service import SPEC
from tests.farm import LIPPMANN
from tests.integration.service.conftest import FakeWorker, Service
from tests.waiting import ENOUGH_S, until


def _events(answer: httpx.Response) -> Iterator[tuple[int, str, Any]]:
    event: dict[str, str] = {}
    for line in answer.iter_lines():
        if line and not line.startswith(":"):
            name, _, value = line.partition(": ")
            event[name] = value
        elif not line and "data" in event:
            yield int(event["id"]), event["event"], json.loads(event["data"])
            event = {}


def _submit(service: Service, **changes: Any) -> str:
    return str(service.client.post("/jobs", json=SPEC | changes).json()["id"])


def _listen(service: Service, path: str, last: int | None = None) -> Any:
    headers = {} if last is None else {"Last-Event-ID": str(last)}
    return service.client.stream("GET", path, headers=headers)


def test_a_listener_first_hears_how_the_job_stands_and_then_everything_until_it_is_done(
    service: Service, make_worker: Callable[..., FakeWorker]
) -> None:
    job_id = _submit(service)
    heard: list[tuple[int, str, Any]] = []
    with _listen(service, f"/jobs/{job_id}/events") as answer:
        assert answer.headers["Content-Type"].startswith("text/event-stream")
        for event in _events(answer):
            if not heard:
                make_worker()
            heard.append(event)
            if event[1] == "job" and event[2]["status"] == "done":
                break
    assert heard[0][1] == "job"
    assert heard[0][2]["status"] == "queued"
    assert [data["status"] for _, topic, data in heard if topic == "job"] == ["queued", "probing", "running", "done"]
    frames = [(data["frame"], data["status"]) for _, topic, data in heard if topic == "frame"]
    assert [frame for frame in frames if frame[1] == "done"] == [(1, "done"), (2, "done"), (3, "done")]
    assert {topic for _, topic, _ in heard} == {"job", "task", "frame", "progress"}
    ids = [identifier for identifier, _, _ in heard]
    assert ids == sorted(set(ids))


def test_a_listener_that_comes_back_hears_what_it_missed_and_nothing_twice(
    service: Service, make_worker: Callable[..., FakeWorker]
) -> None:
    job_id = _submit(service)
    make_worker()
    until(lambda: service.status(job_id) == "done")

    def listen(last: int, count: int | None) -> list[tuple[int, str, Any]]:
        heard = []
        with _listen(service, f"/events?job={job_id}", last) as answer:
            for event in _events(answer):
                heard.append(event)
                if len(heard) == count or (event[1] == "job" and event[2]["status"] == "done"):
                    break
        return heard

    whole = listen(0, None)
    assert len(whole) > 20
    first = listen(0, 7)
    assert first + listen(first[-1][0], None) == whole


def test_a_listener_hears_only_of_its_job(service: Service, make_worker: Callable[..., FakeWorker]) -> None:
    make_worker()
    other, mine = _submit(service, frames="1-9"), _submit(service)
    until(lambda: service.status(other) == service.status(mine) == "done")
    with _listen(service, f"/events?job={mine}", 0) as answer:
        for _, topic, data in _events(answer):
            assert mine in (data.get("job"), data.get("id"))
            if topic == "job" and data["status"] == "done":
                break


def test_an_idle_stream_says_that_it_is_alive(make_service: Callable[..., Service]) -> None:
    service = make_service(keepalive_s=0.2)
    with _listen(service, "/events") as answer:
        assert ": alive" in (line for line in answer.iter_lines())


def test_open_streams_end_at_once_when_the_service_stops(service: Service) -> None:
    opened, ended = threading.Event(), threading.Event()

    def listen() -> None:
        with _listen(service, "/events") as answer:
            for _ in answer.iter_lines():
                opened.set()
        ended.set()

    threading.Thread(target=listen, daemon=True).start()
    assert opened.wait(ENOUGH_S)
    service.server.should_exit = True
    assert ended.wait(ENOUGH_S)
    service.stop()


def test_a_stream_ends_when_its_key_is_revoked(make_service: Callable[..., Service]) -> None:
    service = make_service(keepalive_s=0.1)
    made = service.client.post("/keys", json={"name": "lab", "role": "viewer"}).json()
    ended = threading.Event()

    def listen() -> None:
        headers = {"Authorization": f"Bearer {made['key']}"}
        with httpx.stream("GET", f"{service.url}/api/v1/events", headers=headers, timeout=ENOUGH_S) as answer:
            for _ in answer.iter_raw():
                began.set()
        ended.set()

    began = threading.Event()
    threading.Thread(target=listen, daemon=True).start()
    assert began.wait(ENOUGH_S)
    assert not ended.wait(0.5)
    assert service.client.delete(f"/keys/{made['id']}").status_code == 204
    assert ended.wait(ENOUGH_S)


def _append(service: Service, *job_ids: str, text: str = "") -> int:
    """Append an event of each job, as another process would; return the position of the last."""
    with service.state.database.writing() as session:
        event_rows.append(session, [(job_id, EventTopic.PROGRESS, {"text": text}) for job_id in job_ids])
    with service.state.database.reading() as session:
        return event_rows.newest(session)


def _connect(url: str, last: int, key: str) -> socket.socket:
    """Open a stream whose answer nobody has read yet."""
    host, _, port = url.removeprefix("http://").partition(":")
    connection = socket.create_connection((host, int(port)), timeout=ENOUGH_S)
    lines = ("GET /api/v1/events HTTP/1.1", f"Host: {host}", f"Authorization: Bearer {key}", f"Last-Event-ID: {last}")
    connection.sendall("\r\n".join((*lines, "", "")).encode())
    return connection


def _read_until(connection: socket.socket, position: int) -> list[int]:
    """Read a stream up to an event; return the ids of all events."""
    ids: list[int] = []
    with connection.makefile("rb") as lines:
        for line in lines:
            if line.startswith(b"id: "):
                ids.append(int(line.split()[1]))
            if line.startswith(b"data: ") and ids[-1] == position:
                return ids
    raise AssertionError(f"expected event {position}, got the end of the stream after {ids[-1:]}")


def test_many_clients_take_no_thread_each_and_leave_nothing_behind(service: Service) -> None:
    key, hub = service.new_key(Role.VIEWER), service.state.hub
    position = _append(service, "a")
    with ExitStack() as stack:
        threads_before = threading.active_count()
        connections = [stack.enter_context(_connect(service.url, position, key)) for _ in range(150)]
        until(lambda: len(hub._clients) == 150)
        position = _append(service, "a")
        assert [_read_until(connection, position) for connection in connections] == [[position]] * 150
        # The 40 threads of requests check the keys once; streams take none.
        assert threading.active_count() <= threads_before + 45
    until(lambda: not hub._clients)
    assert hub._position is None


def test_a_client_that_does_not_read_holds_no_memory_and_misses_nothing(service: Service) -> None:
    key, hub = service.new_key(Role.VIEWER), service.state.hub
    position = _append(service, "a")
    with _connect(service.url, position, key) as slow, _connect(service.url, position, key) as quick:
        until(lambda: len(hub._clients) == 2)
        text, count = "x" * 100_000, 200
        for number in range(1, count + 1):
            _append(service, "a", text=text)
            service.state.wakeup.notify()
            _read_until(quick, position + number)
            assert all(client._size <= QUEUE_BYTES + len(text) for client in hub._clients)
        assert [client.lags for client in hub._clients].count(True) == 1
        expected = list(range(position + 1, position + count + 1))
        assert _read_until(slow, position + count) == expected


@contextmanager
def _serving(url: str, broker: Broker, folder: Path) -> Iterator[str]:
    """Run a service in a process of its own, which never leads; yield its URL."""
    env = {
        **os.environ,
        "LIPPMANN_DATABASE_URL": url,
        "LIPPMANN_REDIS_URL": broker.url,
        "LIPPMANN_DATA_DIR": str(folder),
        "LIPPMANN_COORDINATOR": "false",
    }
    command = [LIPPMANN, "serve", "--json", "--port", "0"]
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield str(json.loads(process.stdout.readline())["url"])
        finally:
            process.terminate()


def test_clients_of_several_services_on_one_database_receive_all_events(
    make_service: Callable[..., Service], broker: Broker, tmp_path: Path, url: str
) -> None:
    service = make_service(database_url=url)
    key = service.new_key(Role.VIEWER)
    position = _append(service, "a")
    with _serving(url, broker, tmp_path / "other") as other, ExitStack() as stack:
        connections = [stack.enter_context(_connect(at, position, key)) for at in (service.url, other)]
        first = _append(service, "a")
        assert [_read_until(connection, first) for connection in connections] == [[first]] * 2
        for _ in range(20):
            last = _append(service, "a", "b")
            service.state.wakeup.notify()
        received = [_read_until(connection, last) for connection in connections]
    with service.state.database.reading() as session:
        stored = [row.id for row in event_rows.after(session, first, job_id=None, limit=1000)]
    assert received == [stored, stored]
    assert len(stored) == 40
