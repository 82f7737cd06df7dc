"""Every error is a problem, with a name for the request that met it."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from sqlalchemy.exc import OperationalError

import service.errors
from lippmann import errors
from service.api import listings as browse
from service.errors import STATUS_OF_CODE, ServiceError
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


def test_a_method_that_an_address_does_not_have_is_named_with_those_that_it_has(api: Client) -> None:
    refused = api.put("/api/v1/jobs")
    assert refused.json()["detail"] == "expected GET or HEAD or POST, got PUT"
    assert refused.headers["allow"] == "GET, HEAD, POST"


@pytest.mark.parametrize("path", ["/api/v1/health", "/api/v1/jobs", "/docs", "/api/v1/nothing", "/api/v1/events"])
def test_head_is_get_without_the_body(api: Client, path: str) -> None:
    head = api.head(path)
    assert head.content == b""
    if path != "/api/v1/events":
        got = api.get(path)
        assert (head.status_code, head.headers["content-type"]) == (got.status_code, got.headers["content-type"])
        assert head.headers["content-length"] == got.headers["content-length"]


def test_head_uses_no_login_link_up(api: Client) -> None:
    link = api.post("/api/v1/login-tokens").json()["url"]
    refused = api.head(link)
    assert (refused.status_code, refused.headers["allow"]) == (405, "GET, POST")
    assert api.get(link, follow_redirects=False).status_code == 303


@pytest.mark.parametrize(
    ("accept", "kind"),
    [
        ("text/html", "text/html"),
        ("application/xhtml+xml, text/HTML;q=0.9", "text/html"),
        ("*/*", "application/problem+json"),
        ("*/*;q=0.1, text/html;q=0", "application/problem+json"),
        ("text/htmlx, ,;q=x", "application/problem+json"),
    ],
)
def test_a_problem_is_a_page_for_those_who_accept_pages(api: Client, accept: str, kind: str) -> None:
    assert api.get("/nothing", headers={"Accept": accept}).headers["content-type"].startswith(kind)


def test_a_wrong_cursor_is_named(api: Client, api_farm: Farm) -> None:
    job_id = api_farm.submit()
    answer = api.get(f"/api/v1/jobs/{job_id}/tasks", params={"cursor": "soon"})
    assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "cursor")


def test_a_wrong_query_is_named_with_what_was_expected_and_what_came(api: Client) -> None:
    (error,) = api.get("/api/v1/jobs?limit=many").json()["errors"]
    assert (error["field"], error["got"]) == ("limit", "'many'")
    assert "a whole number" in error["expected"]


@pytest.mark.promise("People", "Errors of the service say nothing of its inside.")
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


@pytest.mark.parametrize("kind", ["application/json", "multipart/form-data; boundary=x", "multipart/x"])
@pytest.mark.parametrize("says_its_size", [True, False])
def test_a_job_file_that_is_too_large_is_refused_whatever_it_says_it_is(
    api: Client, says_its_size: bool, kind: str
) -> None:
    data = b"x" * 100_000
    body: Any = data * 21 if says_its_size else iter([data] * 21)
    answer = api.post("/api/v1/jobs", content=body, headers={"Content-Type": kind})
    assert (answer.status_code, answer.json()["code"]) == (413, "too-large")


def test_an_upload_that_is_too_large_is_refused(make_farm: Any, make_client: Any) -> None:
    client = make_client(make_farm(body_limit_mb=0.1, coordinator=False))
    for size, status in ((90_000, 201), (110_000, 413)):
        files = {"bundle": ("scene.zip", b"PK" + b"x" * size)}
        assert client.post("/api/v1/scenes", params={"name": "mine"}, files=files).status_code == status


def test_an_upload_that_is_no_form_has_the_limit_of_a_job_file(api: Client) -> None:
    kind = {"Content-Type": "application/x-www-form-urlencoded"}
    answer = api.post("/api/v1/scenes", params={"name": "mine"}, content=b"a=" + b"x" * 2_100_000, headers=kind)
    assert (answer.status_code, answer.json()["code"]) == (413, "too-large")


def _pieces_read(client: Client, path: str, headers: dict[str, str]) -> tuple[int, int]:
    """Send a body that never ends; return the answer's status and how many pieces of 100 kB were taken."""
    read, said = 0, []

    async def receive() -> dict[str, Any]:
        nonlocal read
        read += 1
        return {"type": "http.request", "body": b"x" * 100_000, "more_body": True}

    async def send(message: Any) -> None:
        said.append(message)

    path, _, query = path.partition("?")
    scope = {"type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": "POST", "scheme": "http",
             "path": path, "raw_path": path.encode(), "query_string": query.encode(), "root_path": "",
             "headers": [(name.lower().encode(), value.encode()) for name, value in headers.items()],
             "client": ("127.0.0.1", 1), "server": ("127.0.0.1", 1)}  # fmt: skip

    async def ask() -> None:
        await client.app(scope, receive, send)

    asyncio.run(ask())
    return said[0]["status"], read


@pytest.mark.promise("Before login", "Of an upload, nothing is read before it is known who sends it.")
@pytest.mark.parametrize("key", [None, "Bearer lip_0_0"])
def test_of_an_upload_nothing_is_read_before_it_is_known_who_sends_it(api: Client, key: str | None) -> None:
    headers = {"Content-Type": "multipart/form-data; boundary=x"} | ({"Authorization": key} if key else {})
    assert _pieces_read(api, "/api/v1/scenes?name=x", headers) == (401, 0)


def test_of_anything_else_no_more_is_read_than_a_job_file_may_have(api: Client) -> None:
    status, pieces = _pieces_read(api, "/api/v1/jobs", {"Content-Type": "multipart/x"})
    assert (status, pieces) == (413, 21)


def test_every_code_of_the_service_has_a_status() -> None:
    # The broker is never asked in a request, and only the coordinator proves that it leads: their errors answer none.
    of_coordinator = {service.errors.BrokerUnavailable.code, service.errors.NotLeading.code}
    codes = {kind.code for kind in ServiceError.__subclasses__()} - of_coordinator
    assert codes <= set(STATUS_OF_CODE)
    answered = {errors.SpecError, errors.OpticsError, errors.BundleError, errors.StoreFull, errors.StoreUnavailable,
                errors.ArtifactMissing, errors.ArtifactBroken}  # fmt: skip
    assert {kind.code for kind in answered} <= set(STATUS_OF_CODE)
