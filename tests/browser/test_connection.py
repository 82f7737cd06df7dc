"""What the page says and does when the service does not answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from playwright.sync_api import Page, Route, expect

from service.dashboard.assets import MODULES_OF_PAGE, assets
from tests.browser.conftest import Farm, Watch
from tests.waiting import until


def test_a_lost_connection_is_said_nothing_is_forgotten_and_it_comes_back(
    page: Page, farm: Farm, watch: Watch, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    farm.submit()
    log_in()
    expect(page.locator(".frames .cell")).to_have_count(6)
    page.context.set_offline(True)
    expect(page.get_by_text("Connection lost, trying again")).to_be_visible()
    expect(page.get_by_role("link", name="A pond")).to_be_visible()
    expect(page.locator(".frames .cell")).to_have_count(6)
    farm.submit(title="Meanwhile")
    page.context.set_offline(False)
    expect(page.get_by_role("link", name="Meanwhile")).to_be_visible()
    expect(page.get_by_text("Connection lost, trying again")).to_have_count(0)
    assert all("ERR_INTERNET_DISCONNECTED" in text for text in watch.complaints)
    watch.complaints.clear()


def test_without_the_stream_the_page_goes_on_by_asking(
    page: Page, farm: Farm, watch: Watch, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    farm.submit()
    page.route("**/api/v1/events", lambda route: route.abort())
    log_in()
    expect(page.get_by_text("Live updates are interrupted")).to_be_visible()
    farm.studio.let(100)
    until(lambda: farm.service.client.get("/jobs").json()["items"][0]["status"] == "done")
    expect(page.get_by_role("link", name="A pond")).to_contain_text("done")
    expect(page.locator(".frames .cell.done")).to_have_count(6)
    assert all("ERR_FAILED" in text for text in watch.complaints)
    watch.complaints.clear()


def test_a_service_that_answers_nothing_but_the_stream_is_said_to_be_lost_until_it_answers(
    page: Page, watch: Watch, log_in: Callable[[], Page]
) -> None:
    page.route("**/api/v1/health", lambda route: route.abort())
    log_in()
    expect(page.get_by_text("Connection lost, trying again")).to_be_visible()
    page.unroute("**/api/v1/health")
    expect(page.get_by_text("Connection lost, trying again")).to_have_count(0)
    assert all("ERR_FAILED" in text for text in watch.complaints)
    watch.complaints.clear()


def test_a_frame_that_is_done_before_the_statuses_say_so_is_shown(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.submit()
    until(lambda: farm.service.client.get("/jobs").json()["items"][0]["status"] == "done")
    page.route("**/frames/statuses", _as_before)
    log_in()
    expect(page.get_by_text("Frame 6 · ")).to_be_visible()


def test_a_page_that_is_older_than_the_service_says_so_after_the_restart(
    page: Page, watch: Watch, log_in: Callable[[], Page], monkeypatch: pytest.MonkeyPatch
) -> None:
    log_in()
    reload = page.get_by_role("button", name="Reload the page")
    page.context.set_offline(True)
    expect(page.get_by_text("Connection lost, trying again")).to_be_visible()
    with page.expect_response("**/static/page.js") as same:
        page.context.set_offline(False)
    assert same.value.status == 304
    expect(reload).to_have_count(0)
    found = assets()
    newer = replace(found[MODULES_OF_PAGE], digest="0" * 16)
    monkeypatch.setattr("service.dashboard.pages.assets", lambda: {**found, MODULES_OF_PAGE: newer})
    page.context.set_offline(True)
    expect(page.get_by_text("Connection lost, trying again")).to_be_visible()
    page.context.set_offline(False)
    reload.click()
    expect(page.get_by_role("heading", name="Jobs")).to_be_visible()
    expect(reload).to_have_count(0)
    assert all("ERR_INTERNET_DISCONNECTED" in text for text in watch.complaints)
    watch.complaints.clear()


def test_a_computer_whose_clock_is_wrong_by_a_day_still_says_when_a_job_was_submitted(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    farm.submit()
    page.clock.install(time=datetime.now(UTC) + timedelta(days=1))
    log_in()
    expect(page.locator(".facts time")).to_have_text("just now")


def test_a_fault_in_one_page_is_said_and_leaves_the_rest(
    page: Page, farm: Farm, watch: Watch, log_in: Callable[[], Page]
) -> None:
    job_id = farm.submit_held()
    log_in()
    page.route(f"**/api/v1/jobs/{job_id}", lambda route: route.fulfill(json=route.fetch().json() | {"size": None}))
    page.goto(f"{farm.url}/#/farm")
    page.reload()
    expect(page.get_by_role("heading", name="Farm")).to_be_visible()
    page.goto(f"{farm.url}/#/jobs/{job_id}")
    expect(page.get_by_role("heading", name="This page cannot be drawn")).to_be_visible()
    page.get_by_role("link", name="Account", exact=True).click()
    expect(page.get_by_role("heading", name="Your account")).to_be_visible()
    assert watch.complaints
    watch.complaints.clear()


def _as_before(route: Route) -> None:
    """Answer with the statuses as they were when the job began."""
    answer = route.fetch()
    runs = [run | {"status": "waiting"} for run in answer.json()["runs"]]
    route.fulfill(response=answer, json={"runs": runs})
