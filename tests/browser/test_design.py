"""What a job will give, before it is submitted and on its own page."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.browser.conftest import Farm


def test_the_submit_page_shows_the_design_of_what_is_filled_in(page: Page, log_in: Callable[[], Page]) -> None:
    log_in()
    design = page.get_by_role("region", name="Design")
    expect(design.get_by_role("img", name="fish")).to_be_visible()
    expect(design).to_contain_text("Focal length300.5 mm")
    expect(design).to_contain_text("near parts are shown real, far ones virtual")
    page.get_by_label("Offset mm").fill("60")
    expect(design).to_contain_text("all is shown real")
    stroke = design.locator(".ray.near").first.evaluate("line => getComputedStyle(line).stroke")
    assert stroke not in ("none", "rgb(0, 0, 0)")
    design.get_by_role("button", name="Enlarge").click()
    expect(page.get_by_role("dialog", name="The optical bench")).to_be_visible()
    page.keyboard.press("Escape")
    design.get_by_text("What the numbers mean").click()
    expect(design.get_by_text("The effective focal length of the imaging lens.")).to_be_visible()


def test_a_job_s_page_shows_its_design_when_it_is_opened(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    farm.studio.hold()
    job_id = farm.submit()
    log_in()
    page.goto(f"{farm.url}/#/jobs/{job_id}")
    page.get_by_text("Optics and display").click()
    design = page.get_by_role("region", name="Design")
    expect(design.get_by_role("img", name="A pond")).to_be_visible()
    expect(design).to_contain_text("Viewing angle")
