"""Addresses of pages: Back and Forward, titles, the scroll position, and addresses that name no page."""

from __future__ import annotations

import re
from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.browser.conftest import Farm
from tests.waiting import until


def test_back_and_forward_lead_through_pages_and_return_to_where_the_user_was(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    job_id = farm.submit(frames="1-300")
    log_in()
    expect(page).to_have_title(re.compile("^A pond . Lippmann$"))
    expect(page.locator(".frames .cell")).to_have_count(120)
    page.mouse.move(700, 500)
    page.mouse.wheel(0, 600)
    until(lambda: page.evaluate("history.state?.scroll_px") == page.evaluate("scrollY") > 0)
    scrolled_px = page.evaluate("scrollY")
    page.evaluate("location.hash = '#/new'")  # A click would scroll to the link first.
    expect(page).to_have_title(re.compile("^New job . Lippmann$"))
    until(lambda: page.evaluate("scrollY") == 0)
    page.evaluate("location.hash = '#/jobs/a/b'")
    expect(page.get_by_role("heading", name="There is no such page")).to_be_visible()
    expect(page).to_have_title(re.compile("^No such page . Lippmann$"))
    page.go_back()
    expect(page).to_have_title(re.compile("^New job . Lippmann$"))
    page.go_back()
    expect(page).to_have_url(re.compile(f"#/jobs/{job_id}$"))
    until(lambda: page.evaluate("scrollY") == scrolled_px)
    page.go_forward()
    expect(page).to_have_title(re.compile("^New job . Lippmann$"))
