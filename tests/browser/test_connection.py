"""What the page says and does when the service does not answer."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

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
    assert all("ERR_INTERNET_DISCONNECTED" in text or "Unprocessable" in text for text in watch.complaints)
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
    # A slow page may show the form of a new job until the list is there, and the form asks for a design of nothing.
    assert all("ERR_FAILED" in text or "Unprocessable" in text for text in watch.complaints)
    watch.complaints.clear()
