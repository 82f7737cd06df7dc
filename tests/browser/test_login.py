"""Who comes in, and how."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

from lippmann.farm.browser_door import open_browser
from service.auth import create_login_token
from service.schemas.access import Role
from tests.browser.conftest import Farm, Watch

REFUSAL = "the server responded with a status of 401"


def test_a_key_opens_the_dashboard_and_logging_out_closes_it(
    page: Page, log_in: Callable[[], Page], watch: Watch
) -> None:
    log_in()
    expect(page.get_by_text("No jobs yet.")).to_be_visible()
    page.get_by_role("button", name="Log out").click()
    expect(page.get_by_label("API key")).to_be_visible()
    # A question that was on its way when the session ended is refused, and Chromium reports that.
    assert all(REFUSAL in text for text in watch.complaints)
    watch.complaints.clear()


def test_a_wrong_key_is_said_beside_the_field(page: Page, farm: Farm, watch: Watch) -> None:
    page.goto(farm.url)
    page.get_by_label("API key").fill("lip_000000000000_wrong")
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("alert")).to_have_text("this key is unknown")
    expect(page.get_by_label("API key")).to_have_attribute("aria-invalid", "true")
    # Chromium itself reports every refusal; nothing else may complain.
    assert all(REFUSAL in text for text in watch.complaints)
    watch.complaints.clear()


def test_who_loses_the_key_while_a_job_is_open_is_told_so_and_comes_back_to_it(
    page: Page, farm: Farm, watch: Watch, log_in: Callable[[str], Page]
) -> None:
    farm.studio.hold()
    job_id = farm.submit()
    key = farm.service.new_key(Role.SUBMITTER)
    log_in(key)
    page.goto(f"{farm.url}/#/jobs/{job_id}?look=sheet")
    expect(page.get_by_role("heading", name="A pond")).to_be_visible()
    farm.service.client.delete(f"/keys/{key.split('_')[1]}").raise_for_status()
    expect(page.get_by_role("alert")).to_contain_text("Your session has ended")
    page.get_by_label("API key").fill(farm.key)
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_role("heading", name="A pond")).to_be_visible()
    assert page.url == f"{farm.url}/#/jobs/{job_id}?look=sheet"
    assert all(REFUSAL in text for text in watch.complaints)
    watch.complaints.clear()


def test_a_login_link_opens_the_dashboard(page: Page, farm: Farm) -> None:
    with farm.service.state.database.writing() as session:
        token = create_login_token(session)
    page.goto(f"{farm.url}/login?token={token}")
    expect(page.get_by_role("heading", name="Jobs")).to_be_visible()


def test_the_browser_of_up_comes_in_by_an_address_that_is_no_link(page: Page, farm: Farm, watch: Watch) -> None:
    with farm.service.state.database.writing() as session:
        token = create_login_token(session)
    addresses: list[str] = []

    def open_at(address: str) -> bool:
        addresses.append(address)
        return True

    open_browser(lambda: f"{farm.url}/login?token={token}", open_at)
    assert token not in addresses[0]
    page.goto(addresses[0])
    expect(page.get_by_role("heading", name="Jobs")).to_be_visible()
    page.reload()
    expect(page.get_by_role("heading", name="Jobs")).to_be_visible()
    assert watch.strangers == addresses
    watch.strangers.clear()


def test_a_viewer_sees_jobs_and_no_buttons_that_change_them(
    page: Page, farm: Farm, log_in: Callable[[str], Page]
) -> None:
    farm.studio.hold()
    farm.submit()
    log_in(farm.service.new_key(Role.VIEWER))
    expect(page.get_by_role("heading", name="A pond")).to_be_visible()
    expect(page.get_by_role("button", name="Cancel", exact=True)).to_have_count(0)
    expect(page.get_by_role("link", name="New job")).to_have_count(0)
