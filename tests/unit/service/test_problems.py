"""Every error is a problem, with a name for the request that met it."""

from __future__ import annotations

from typing import Any

import pytest
from sqlalchemy.exc import OperationalError

import service.errors
import worker.errors
from service.errors import STATUS_OF_CODE, ServiceError
from service.jobs import browse
from tests.builders_service import Client, Farm

MEMBERS = {"type", "title", "status", "detail", "code", "instance", "request_id", "errors"}


@pytest.mark.parametrize(
    ("method", "path", "status", "code"),
    [
        ("GET", "/api/v1/nowhere", 404, "not-found"),
        ("PUT", "/api/v1/jobs", 405, "method-not-allowed"),
        ("GET", "/api/v1/jobs/none", 404, "not-found"),
        ("GET", "/api/v1/jobs/none/tasks", 404, "not-found"),
        ("GET", "/api/v1/jobs/none/tasks/x", 404, "not-found"),
        ("GET", "/api/v1/jobs/none/tasks/x/log", 404, "not-found"),
        ("GET", "/api/v1/jobs/none/frames", 404, "not-found"),
        ("GET", "/api/v1/jobs/none/artifacts", 404, "not-found"),
        ("GET", "/api/v1/jobs/none/artifacts/x", 404, "not-found"),
        ("GET", "/api/v1/jobs/none/events", 404, "not-found"),
        ("POST", "/api/v1/jobs/none/cancel", 404, "not-found"),
        ("GET", "/api/v1/scenes/none", 404, "not-found"),
        ("GET", "/api/v1/jobs?limit=0", 422, "invalid"),
        ("GET", "/api/v1/jobs?limit=501", 422, "invalid"),
        ("GET", "/api/v1/jobs?status=asleep", 422, "invalid"),
        ("POST", "/api/v1/jobs", 422, "invalid"),
    ],
)
def test_errors_are_problems(api: Client, method: str, path: str, status: int, code: str) -> None:
    answer = api.request(method, path, headers={"X-Request-Id": "mine-7"})
    problem = answer.json()
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert set(problem) == MEMBERS
    assert (answer.status_code, problem["status"], problem["code"]) == (status, status, code)
    assert problem["type"] == f"urn:lippmann:problem:{code}"
    assert problem["request_id"] == answer.headers["X-Request-Id"] == "mine-7"
    assert problem["detail"]


def test_a_wrong_cursor_is_named(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.submit()
    answer = api.get(f"/api/v1/jobs/{job_id}/tasks", params={"cursor": "soon"})
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "cursor")


def test_a_wrong_query_is_named_with_what_was_expected_and_what_came(api: Client) -> None:
    (error,) = api.get("/api/v1/jobs?limit=many").json()["errors"]
    assert (error["field"], error["got"]) == ("limit", "'many'")
    assert "integer" in error["expected"]


def test_a_fault_of_ours_says_nothing_of_our_inside(api: Client, monkeypatch: pytest.MonkeyPatch) -> None:
    def fault(*_: Any, **__: Any) -> None:
        raise RuntimeError("secret of ours")

    monkeypatch.setattr(browse, "page_jobs", fault)
    answer = api.get("/api/v1/jobs")
    assert (answer.status_code, answer.json()["code"]) == (500, "internal")
    assert answer.headers["Content-Type"] == "application/problem+json"
    assert "secret" not in answer.text


@pytest.mark.parametrize(
    ("said", "status", "code"),
    [("database is locked", 503, "database-unavailable"), ("database or disk is full", 507, "store-full")],
)
def test_a_database_that_does_not_answer_is_said(
    api: Client, monkeypatch: pytest.MonkeyPatch, said: str, status: int, code: str
) -> None:
    def fault(*_: Any, **__: Any) -> None:
        raise OperationalError("SELECT", {}, Exception(said))

    monkeypatch.setattr(browse, "page_jobs", fault)
    answer = api.get("/api/v1/jobs")
    assert (answer.status_code, answer.json()["code"]) == (status, code)


def test_a_request_without_a_name_gets_one_and_an_unfit_name_is_replaced(api: Client) -> None:
    assert len(api.get("/api/v1/health").headers["X-Request-Id"]) == 16
    assert len(api.get("/api/v1/health", headers={"X-Request-Id": "a b;c"}).headers["X-Request-Id"]) == 16


@pytest.mark.parametrize("says_its_size", [True, False])
def test_a_job_file_that_is_too_large_is_refused(api: Client, says_its_size: bool) -> None:
    data = b"x" * 100_000
    body: Any = data * 21 if says_its_size else iter([data] * 21)
    answer = api.post("/api/v1/jobs", content=body, headers={"Content-Type": "application/json"})
    assert (answer.status_code, answer.json()["code"]) == (413, "too-large")


def test_an_upload_that_is_too_large_is_refused(make_farm: Any, make_client: Any) -> None:
    client = make_client(make_farm(body_limit_mb=0.1, clerk=False))
    for size, status in ((90_000, 201), (110_000, 413)):
        files = {"bundle": ("scene.zip", b"PK" + b"x" * size)}
        assert client.post("/api/v1/scenes", params={"name": "mine"}, files=files).status_code == status


def test_every_code_of_the_service_has_a_status() -> None:
    # The broker is never asked in a request, so its error answers none.
    codes = {kind.code for kind in ServiceError.__subclasses__()} - {service.errors.BrokerUnavailable.code}
    assert codes <= set(STATUS_OF_CODE)
    asked = {worker.errors.SpecError, worker.errors.OpticsError, worker.errors.BundleError, worker.errors.StoreFull,
             worker.errors.StoreUnavailable, worker.errors.ArtifactMissing, worker.errors.ArtifactBroken}  # fmt: skip
    assert {kind.code for kind in asked} <= set(STATUS_OF_CODE)
