"""What every response carries, and who is refused before anything is done."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
import structlog

from service.rate_limits import REFUSALS_AT_ONCE
from tests.builders_service import Client, Farm
from tests.minutes import stop_minutes

SILENT: dict[str, Any] = {"coordinator": False, "redis_url": "redis://127.0.0.1:1/0"}


@pytest.mark.parametrize("path", ["/", "/api/v1/health", "/api/v1/jobs", "/api/v1/none", "/static/none", "/login"])
def test_every_response_forbids_to_guess_its_type_and_has_an_id(api: Client, path: str) -> None:
    answer = api.get(path, headers={"X-Request-ID": "mine-1"}, follow_redirects=False)
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert answer.headers["X-Request-ID"] == "mine-1"
    assert "Strict-Transport-Security" not in answer.headers


def test_a_request_that_fails_for_an_unknown_reason_has_an_id_in_answer_and_log(
    api: Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise RuntimeError("unknown")

    monkeypatch.setattr("service.routes.jobs.find_job", fail)
    with structlog.testing.capture_logs(processors=[structlog.contextvars.merge_contextvars]) as logged:
        answer = api.get("/api/v1/jobs/j", headers={"X-Request-ID": "mine-2"})
    assert (answer.status_code, answer.headers["X-Request-ID"]) == (500, "mine-2")
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    (line,) = [line for line in logged if line["event"] == "a request failed"]
    key_id = api.headers["Authorization"].split("_")[1]
    assert (line["request_id"], line["job"], line["key"]) == ("mine-2", "j", key_id)


def test_browsers_that_came_by_tls_never_use_plain_http_again(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client]
) -> None:
    secure = make_client(make_farm(public_url="https://farm.example.org", **SILENT))
    assert "max-age=" in secure.get("/api/v1/health").headers["Strict-Transport-Security"]


@pytest.mark.promise("Before login", "An address that sends too many requests is refused.")
def test_an_address_that_sends_too_many_requests_is_told_when_to_return(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock = stop_minutes(monkeypatch)
    clock.now_s += 9.5
    api = make_client(make_farm(requests_per_minute_by_address=3, **SILENT))
    statuses = [api.get("/api/v1/health", headers={"Authorization": ""}).status_code for _ in range(4)]
    refused = api.get("/api/v1/health")
    assert statuses[-1] == refused.status_code == 429
    assert refused.headers["Retry-After"] == "50"
    assert refused.headers["X-Content-Type-Options"] == "nosniff"
    assert refused.json()["code"] == "too-many-requests"
    assert refused.json()["request_id"]


@pytest.mark.promise("Before login", "A flood of requests without a key becomes slow.")
def test_refusals_are_held_back_from_an_address_that_gets_many_and_answers_are_not(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    waits: list[float] = []

    async def sleep(seconds: float) -> None:
        waits.append(seconds)

    stop_minutes(monkeypatch)
    monkeypatch.setattr("service.routes.middleware.asyncio", SimpleNamespace(sleep=sleep))
    api = make_client(make_farm(requests_per_minute_by_address=2 * REFUSALS_AT_ONCE, **SILENT))
    nobody = {"Authorization": ""}
    statuses = [api.get("/api/v1/scenes", headers=nobody).status_code for _ in range(REFUSALS_AT_ONCE + 3)]
    assert set(statuses) == {401}
    assert len(waits) == 3
    while api.get("/api/v1/session").status_code == 200:
        assert len(waits) == 3
    assert len(waits) == 4  # the first answer with 429


def test_a_key_that_sends_too_many_requests_is_told_when_to_return(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    stop_minutes(monkeypatch)
    api = make_client(make_farm(requests_per_minute=2, **SILENT))
    answers = [api.get("/api/v1/session") for _ in range(3)]
    assert [answer.status_code for answer in answers] == [200, 200, 429]
    assert answers[-1].headers["Retry-After"] == "59"


@pytest.mark.promise("Before login", "Failed logins are limited.")
def test_failed_logins_are_limited_and_others_are_not(
    make_farm: Callable[..., Farm], make_client: Callable[[Farm], Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    stop_minutes(monkeypatch)
    api = make_client(make_farm(failed_logins_per_minute=2, **SILENT))
    key = api.headers["Authorization"].removeprefix("Bearer ")

    def log_in(value: str) -> int:
        return int(api.post("/login", data={"key": value}, follow_redirects=False).status_code)

    assert [log_in(key) for _ in range(5)] == [303] * 5
    assert [log_in("wrong"), log_in("wrong"), log_in("wrong"), log_in(key)] == [401, 401, 429, 429]
