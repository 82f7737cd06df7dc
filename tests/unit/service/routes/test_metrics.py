"""What a scrape says, and to whom."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from service.auth import create_key
from service.coordinator.event_consumer import consume_events
from service.main import create_app
from service.schemas.access import Role
from tests.builders_service import Client, Farm, claimed, declined, done, failed
from tests.scraping import Scrape

TOKEN = "a-token-of-the-operator"
SILENT: dict[str, Any] = {"coordinator": False, "redis_url": "redis://127.0.0.1:1/0"}
PATHS = ("/metrics", "/api/v1/waiting")

Ask = Callable[..., Client]


@pytest.fixture
def ask(make_farm: Callable[..., Farm], tmp_path: Path) -> Iterator[Ask]:
    """Lend clients without a key, at an address."""
    with ExitStack() as stack:

        def make(farm: Farm | None = None, *, address: str = "192.0.2.9", **settings: Any) -> Client:
            farm = farm or make_farm(**SILENT, **settings)
            app = create_app(farm.settings, farm.parts, clock=lambda: farm.now_s)
            return stack.enter_context(Client(app, client=(address, 1), raise_server_exceptions=False))

        yield make


@pytest.fixture
def token_file(tmp_path: Path) -> Path:
    (tmp_path / "token").touch(0o600)
    (tmp_path / "token").write_text(TOKEN)
    return tmp_path / "token"


def scrape(client: Client, **headers: str) -> Scrape:
    answer = client.get("/metrics", headers=headers)
    assert answer.status_code == 200, answer.text
    assert answer.headers["Content-Type"].startswith("text/plain; version=0.0.4")
    return Scrape(answer.text)


@pytest.mark.promise("Before login", "The figures of a farm are read with a key, or as its operator has allowed.")
@pytest.mark.parametrize("path", PATHS)
def test_nobody_reads_the_figures_without_a_key_a_token_or_a_listed_address(
    ask: Ask, token_file: Path, path: str
) -> None:
    client = ask(metrics_token_file=token_file, metrics_networks="10.0.0.0/8")
    for headers in ({}, {"Authorization": f"Bearer {TOKEN[:-1]}"}, {"X-Forwarded-For": "10.0.0.1"}):
        answer = client.get(path, headers=headers)
        assert (answer.status_code, "lippmann_" in answer.text) == (401, False)
    assert client.get(path, headers={"Authorization": f"Bearer {TOKEN}"}).status_code == 200


@pytest.mark.parametrize("path", PATHS)
def test_from_a_listed_address_they_are_read_without_a_key_but_not_through_a_proxy(ask: Ask, path: str) -> None:
    client = ask(address="10.7.7.7", metrics_networks="10.0.0.0/8")
    assert client.get(path).status_code == 200
    assert client.get(path, headers={"X-Forwarded-For": "192.0.2.1"}).status_code == 401
    assert client.get("/api/v1/jobs").status_code == 401


@pytest.mark.parametrize("path", PATHS)
def test_every_key_reads_them(ask: Ask, make_farm: Callable[..., Farm], path: str) -> None:
    farm = make_farm(**SILENT)
    with farm.writing() as session:
        _, key = create_key(session, "prometheus", Role.VIEWER)
    assert ask(farm).get(path, headers={"Authorization": f"Bearer {key}"}).status_code == 200


def test_what_is_away_has_no_figures_and_delays_none_of_the_others(ask: Ask, token_file: Path) -> None:
    client = ask(metrics_token_file=token_file)
    found = scrape(client, Authorization=f"Bearer {TOKEN}")
    parts = {name: found("lippmann_component_ok", component=name) for name in ("database", "broker", "store")}
    assert parts == {"database": 1, "broker": 0, "store": 1}
    assert not {"lippmann_slots", "lippmann_workers"} & found.names


def test_without_a_database_the_token_still_opens_the_figures_and_they_say_so(
    ask: Ask, make_farm: Callable[..., Farm], token_file: Path
) -> None:
    farm = make_farm(metrics_token_file=token_file, **SILENT)
    client = ask(farm)
    with farm.writing() as session:
        session.execute(text("DROP TABLE credentials"))
        session.execute(text("DROP TABLE coordinator"))
    found = scrape(client, Authorization=f"Bearer {TOKEN}")
    assert found("lippmann_component_ok", component="database") == 0
    assert not {"lippmann_jobs", "lippmann_leader"} & found.names
    assert found("lippmann_store_free_bytes") == farm.store.free


def test_the_figures_of_jobs_are_those_of_the_database(api_farm: Farm, api: Client) -> None:
    urgent = api_farm.planned(priority=90)
    orders = api_farm.dispatch()
    api_farm.say(claimed(orders[0]))
    api_farm.submit()
    api_farm.now_s += 60
    found = scrape(api)
    assert found("lippmann_jobs", status="running") == found("lippmann_jobs", status="queued") == 1
    assert found("lippmann_jobs", status="done") == 0
    row = api_farm.job(urgent)
    counts = {"waiting": row.waiting, "ready": row.ready, "dispatched": row.dispatched, "running": row.running}
    assert counts == {name: found("lippmann_tasks", status=name, priority="high") for name in counts}
    assert found("lippmann_tasks", status="ready", priority="normal") == 1
    assert found("lippmann_oldest_queued_job_age_seconds") == 60
    work = api.get("/api/v1/waiting").json()
    assert work["waiting_tasks"] == found("lippmann_waiting_tasks") == row.ready + row.dispatched + 1
    assert work["wanted_slots"] == found("lippmann_wanted_slots") == work["waiting_tasks"] + 1


def test_attempts_are_counted_by_how_they_ended_each_once(api_farm: Farm, api: Client) -> None:
    api_farm.planned()
    first, second, *_ = api_farm.dispatch()
    before = scrape(api)
    events = [
        claimed(first), done(first), done(first), claimed(second), failed(second), declined(second),
    ]  # fmt: skip
    api_farm.say(*events)
    # A chunk that another process has written counts nothing here.
    assert not consume_events(
        api_farm.database, [("9-0", done(first))], was="0-0", now_s=api_farm.now_s, settings=api_farm.settings
    )
    after = scrape(api)
    grown = {
        outcome: after("lippmann_attempts_total", outcome=outcome) - before("lippmann_attempts_total", outcome=outcome)
        for outcome in ("done", "failed", "declined", "lost", "deferred", "stopped")
    }
    assert grown == {"done": 1, "failed": 1, "declined": 0, "lost": 0, "deferred": 0, "stopped": 0}


def test_requests_are_measured_by_their_route_and_refusals_are_counted(
    ask: Ask, make_farm: Callable[..., Farm]
) -> None:
    farm = make_farm(requests_per_minute=20, **SILENT)
    client = ask(farm)
    with farm.writing() as session:
        client.headers["Authorization"] = f"Bearer {create_key(session, 'x', Role.VIEWER)[1]}"
    labels = {"method": "GET", "route": "/api/v1/jobs/{job_id}", "status": "4xx"}
    before = scrape(client).values.get(("lippmann_http_request_duration_seconds_count", frozenset(labels.items())), 0.0)
    for number in range(3):
        assert client.get(f"/api/v1/jobs/none-{number}").status_code == 404
    client.request("BREW", "/api/v1/jobs/none")
    client.get("/nothing/here")
    found = scrape(client)
    assert found("lippmann_http_request_duration_seconds_count", **labels) == before + 3
    routes = {dict(labels).get("route", "") for _, labels in found.values}
    assert not [route for route in routes if "none-" in route or "here" in route], routes
    assert {"/metrics", "none"} <= routes
    while client.get("/api/v1/usage").status_code == 200:
        pass
    assert _refused(ask(metrics_networks="192.0.2.0/24"), "key") >= 1


def _refused(client: Client, rate: str) -> float:
    return scrape(client)("lippmann_requests_refused_total", rate=rate)
