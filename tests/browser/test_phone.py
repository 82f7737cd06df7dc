"""The page on a telephone: one thing at a time, and nothing wider than the screen."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.browser.conftest import Farm

TOO_WIDE_PX = "document.documentElement.scrollWidth - window.innerWidth"


def test_list_job_and_form_are_shown_one_at_a_time_and_none_is_wider_than_the_screen(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    farm.submit(title="A title that is a good deal longer than a telephone is wide, and then goes on")
    page.set_viewport_size({"width": 360, "height": 740})
    log_in()
    row, main = page.locator(".jobs .row"), page.get_by_role("main")
    expect(main).to_be_hidden()
    assert page.evaluate(TOO_WIDE_PX) <= 0
    row.click()
    expect(page.locator(".frames .cell")).to_have_count(6)
    expect(row).to_be_hidden()
    assert page.evaluate(TOO_WIDE_PX) <= 0
    page.get_by_role("link", name="All jobs").click()
    expect(row).to_be_visible()
    page.get_by_role("link", name="New job").click()
    expect(page.get_by_label("Fish over water", exact=True)).to_be_attached()
    assert page.evaluate(TOO_WIDE_PX) <= 0
