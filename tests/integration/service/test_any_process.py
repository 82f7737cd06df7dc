"""Two processes of the service on one PostgreSQL: what one of them began, the other one goes on with."""

from __future__ import annotations

import time
from collections.abc import Callable

import httpx
import pytest

from lippmann.client.stream import parse_events
from lippmann.plan import artifact_names as names
from service.auth import create_login_token
from service.schemas.access import Role
from tests.builders_service import SPEC, DictStore, parts
from tests.integration.service.conftest import FakeWorker, Service
from tests.waiting import ENOUGH_S, until

FILE = "integral/0001.exr"


@pytest.fixture
def services(postgresql_url: str, make_service: Callable[..., Service]) -> list[Service]:
    given = parts()
    made = [make_service(given, database_url=postgresql_url, keepalive_s=0.5) for _ in range(2)]
    made[1].client.headers["Authorization"] = made[0].client.headers["Authorization"]
    return made


def test_a_login_a_session_and_a_logout_hold_at_every_process(services: list[Service]) -> None:
    first, second = services
    with first.state.database.writing() as session:
        token = create_login_token(session, now_s=time.time())
    with httpx.Client(timeout=ENOUGH_S) as browser:
        browser.get(f"{first.url}/login", params={"token": token})
        cookies = dict(browser.cookies)
    assert cookies

    def is_in(service: Service) -> bool:
        return httpx.get(f"{service.url}/api/v1/session", cookies=cookies).is_success

    assert [is_in(service) for service in services] == [True, True]
    again = httpx.get(f"{second.url}/login", params={"token": token})
    assert not again.cookies, "a login link is used once"
    httpx.post(f"{second.url}/logout", cookies=cookies, headers={"X-Lippmann-Request": "1"})
    assert [is_in(service) for service in services] == [False, False]


def test_submissions_scenes_and_links_are_those_of_the_farm(
    services: list[Service], make_worker: Callable[..., FakeWorker]
) -> None:
    first, second = services
    make_worker()
    upload = {"bundle": ("ball.zip", b"PK another ball")}
    assert first.client.post("/scenes", params={"name": "mine"}, files=upload).status_code == 201
    job = SPEC | {"scene": "mine"}
    made = [service.client.post("/jobs", json=job, headers={"Idempotency-Key": "once"}).json() for service in services]
    assert made[0]["id"] == made[1]["id"]
    job_id = made[0]["id"]
    until(lambda: second.status(job_id) == "done")
    store: DictStore = first.parts.store  # type: ignore[assignment]
    store.put_bytes(names.job_artifact(job_id, FILE), b"light")
    link = first.client.post(f"/jobs/{job_id}/links", json={"artifact": FILE}).json()["url"]
    path = link[link.index("/api/v1/") :]
    assert [httpx.get(service.url + path).content for service in services] == [b"light"] * 2


def test_a_stream_has_the_events_of_what_another_process_does_and_ends_with_its_key(services: list[Service]) -> None:
    first, second = services
    key = first.new_key(Role.VIEWER)
    headers = {"Authorization": f"Bearer {key}", "Last-Event-ID": "0"}
    with httpx.stream("GET", f"{second.url}/api/v1/events", headers=headers, timeout=ENOUGH_S) as stream:
        events = parse_events(stream.iter_lines())
        job_id = first.client.post("/jobs", json=SPEC).json()["id"]
        assert next(event.data["id"] for event in events if event.type == "job") == job_id
        first.client.delete(f"/keys/{key.split('_')[1]}")
        list(events)  # the stream ends
    assert httpx.get(f"{second.url}/api/v1/jobs", headers=headers).status_code == 401
