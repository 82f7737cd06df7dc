"""The dashboard under a path of a host that has other sites; the page may ask for nothing outside of its path."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Page, expect

from tests.browser.conftest import Farm, Watch
from tests.prefix_proxy import PrefixProxy, prefix_proxy
from tests.waiting import until

LOADED = "picture => picture.complete && picture.naturalWidth > 0"


@pytest.fixture
def proxy() -> Iterator[PrefixProxy]:
    with prefix_proxy("/lab/lippmann") as proxy:
        yield proxy


def test_jobs_pictures_videos_and_the_stream_stay_below_the_path(
    page: Page, farm: Farm, watch: Watch, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    job_id = farm.submit()
    log_in()
    farm.studio.let(1000)
    thumbnails = page.locator(".frames .cell.done img")  # which the stream brings
    expect(thumbnails).to_have_count(6)
    until(lambda: thumbnails.last.evaluate(LOADED))
    until(lambda: page.get_by_label("All views").evaluate("video => video.readyState > 0"))
    address = page.get_by_role("link", name="The job as JSON").get_attribute("href")
    assert address == f"/lab/lippmann/api/v1/jobs/{job_id}"
    page.get_by_role("button", name="Frame 2, show large").click()
    page.get_by_role("radio", name="Sheet").check()
    until(lambda: page.get_by_role("img", name="Frame 2, sheet").evaluate(LOADED))
    page.get_by_role("link", name="New job").click()
    until(lambda: page.locator("form img").first.evaluate(LOADED))
    with page.expect_popup() as opened:
        page.get_by_role("link", name="More about Offset").click()
    expect(opened.value).to_have_url(f"{farm.url}/help/job-file.html#rig.lens_array.offset_mm")
    expect(opened.value.locator("tr:has(:target)")).to_contain_text("positive toward the imaging lens")
    opened.value.get_by_role("link", name="Dashboard").click()
    expect(opened.value).to_have_url(f"{farm.url}/")
    opened.value.close()
    page.get_by_role("button", name="Log out").click()
    expect(page.get_by_label("API key")).to_be_visible()
    watch.complaints.clear()  # of requests that were on their way when the session ended
