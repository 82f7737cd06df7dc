"""The memory of a page that stays open: flat over an hour of updates, frames in a loop, and one job after another.

The long tests take minutes; `make outages ARGS=tests/browser` runs them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, CDPSession, Page, expect

from tests.browser.conftest import PATIENCE_MS, Farm
from tests.browser.page_stream import BUSY, PLAYED, measures
from tests.waiting import until

EVENTS_AN_HOUR = 36_000
"""Ten events a second: what a farm sends whose tasks end five times in a second."""
SAMPLES = 6
MOST_AN_HOUR = {"heap_kB": 2000, "nodes": 500, "listeners": 100, "bitmaps": 4, "urls": 1}
"""How much each measure may grow in an hour of updates, 50 jobs or 200 frames, by a line through the samples."""
MOST_REDRAWS = 200
"""For 1,000 events; it is 3 on a machine that does nothing else, and 1,900 where each event redraws the page."""


@pytest.fixture
def open_page(chromium: Browser, farm: Farm) -> Iterator[Page]:
    """Lend a page with a stream that the test plays."""
    context = chromium.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce")
    context.add_init_script(PLAYED)
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    page.goto(farm.url)
    page.get_by_label("API key").fill(farm.key)
    page.get_by_role("button", name="Log in").click()
    page.get_by_role("heading", name="Jobs").wait_for()
    yield page
    context.close()


@pytest.fixture
def cdp(open_page: Page) -> CDPSession:
    session = open_page.context.new_cdp_session(open_page)
    for domain in ("HeapProfiler", "Performance"):
        session.send(f"{domain}.enable")
    return session


def _half_done(farm: Farm) -> dict[str, Any]:
    """Return a running job that has a frame and waits for more."""
    job = f"/jobs/{farm.submit_held()}"
    farm.studio.let(8)
    until(lambda: farm.service.client.get(job).json()["frames_done"])
    return dict(farm.service.client.get(job).json())


def _looked_at(page: Page, farm: Farm, job_id: str) -> None:
    page.goto(f"{farm.url}/#/jobs/{job_id}")
    expect(page.locator(".stage canvas[aria-busy=false]:not(.empty)")).to_be_visible()


def _growth(page: Page, cdp: CDPSession, work: Callable[[int], None]) -> dict[str, float]:
    """Return how much each measure grows from the first to the last of some rounds of work, after one to warm up."""
    work(0)
    samples = [measures(page, cdp)]
    for number in range(1, SAMPLES):
        work(number)
        samples.append(measures(page, cdp))
    print(*samples, sep="\n")
    slopes = {name: np.polyfit(range(SAMPLES), [one[name] for one in samples], 1)[0] for name in samples[0]}
    return {name: float(slope) * (SAMPLES - 1) for name, slope in slopes.items()}


def _too_much(growth: dict[str, float], share_of_hour: float = 1.0) -> dict[str, float]:
    an_hour = {name: grown / share_of_hour for name, grown in growth.items()}
    print(an_hour)
    return {name: grown for name, grown in an_hour.items() if grown > MOST_AN_HOUR[name]}


@pytest.mark.long
def test_an_hour_of_updates_leaves_the_memory_as_it_was(open_page: Page, farm: Farm, cdp: CDPSession) -> None:
    job = _half_done(farm)
    _looked_at(open_page, farm, job["id"])
    events = EVENTS_AN_HOUR // SAMPLES

    def updates(number: int) -> None:
        given = {"job": job, "from": number * events, "events": events, "pause_ms": 20, "at_once": 10}
        open_page.evaluate(BUSY, given)

    assert _too_much(_growth(open_page, cdp, updates), share_of_hour=(SAMPLES - 1) / SAMPLES) == {}


@pytest.mark.long
def test_fifty_jobs_one_after_another_leave_nothing_behind(open_page: Page, farm: Farm, cdp: CDPSession) -> None:
    jobs = [farm.submit() for _ in range(5)]
    until(lambda: all(farm.service.status(job_id) == "done" for job_id in jobs))

    def visits(_: int) -> None:
        for job_id in jobs * 2:
            _looked_at(open_page, farm, job_id)

    assert _too_much(_growth(open_page, cdp, visits)) == {}


@pytest.mark.long
def test_frames_in_a_loop_leave_nothing_behind(open_page: Page, farm: Farm, cdp: CDPSession) -> None:
    job_id = farm.submit()
    until(lambda: farm.service.status(job_id) == "done")
    _looked_at(open_page, farm, job_id)
    open_page.get_by_role("button", name="Play").click()
    assert _too_much(_growth(open_page, cdp, lambda _: open_page.wait_for_timeout(5000))) == {}


def test_a_burst_of_a_thousand_events_redraws_the_page_a_few_times(open_page: Page, farm: Farm) -> None:
    job = _half_done(farm)
    _looked_at(open_page, farm, job["id"])
    open_page.evaluate("""() => {
      window.redraws = 0;
      new MutationObserver(() => window.redraws++).observe(document.body,
        { subtree: true, childList: true, attributes: true, characterData: true });
    }""")
    given = {"job": job, "from": 1, "events": 1000, "pause_ms": 0, "at_once": 1}
    open_page.evaluate(BUSY, given)
    open_page.wait_for_function("window.redraws > 0")
    assert open_page.evaluate("() => window.redraws") < MOST_REDRAWS
