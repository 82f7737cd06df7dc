"""The list of 10,000 jobs: smooth, searched, filtered, sorted, changed several at once, and still under the pointer."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect
from sqlalchemy import insert, select

from lippmann.job.states import JobStatus
from service.db.tables import Job
from tests.browser.conftest import Farm
from tests.browser.scrolling import LONGEST_STEP_MS, scroll
from tests.waiting import until

JOBS = 10_000
MOST_NODES = 60
"""Rows that are in the document at the same time; about ten can be seen."""


def _fill(farm: Farm) -> None:
    """Store 10,000 jobs that have ended: copies of one of the service's own."""
    job_id = farm.submit(frames="1", outputs=[])
    until(lambda: farm.service.status(job_id) == "done")
    with farm.service.state.database.writing() as session:
        job = dict(session.execute(select(Job.__table__).where(Job.id == job_id)).mappings().one())
        ended = [JobStatus.DONE, JobStatus.DONE, JobStatus.FAILED]
        rows = [
            job | {"id": f"0{number:016}", "title": f"Tank {number}", "status": ended[number % 3], "cpu_s": number / 10}
            for number in range(JOBS - 1)
        ]
        rows[7] |= {"owner": "ann", "owner_id": "ann"}  # far below the rows that the page loads
        session.execute(insert(Job), rows)


def test_ten_thousand_jobs_are_scrolled_searched_sorted_and_removed(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    _fill(farm)
    log_in()
    jobs = page.get_by_role("navigation", name="Jobs")
    heading, rows = jobs.get_by_role("heading", name="Jobs"), jobs.locator("li")
    expect(heading).to_contain_text("10,000")
    expect(rows.first).to_contain_text("A pond")
    assert scroll(page, jobs) < LONGEST_STEP_MS
    expect(rows.last).to_contain_text("Tank 0 ")
    assert rows.count() < MOST_NODES

    owners = jobs.get_by_label("Owner", exact=True)
    owners.select_option("ann")
    expect(heading).to_have_text("Jobs 1")
    expect(rows.first).to_contain_text("Tank 7 ")
    owners.select_option("All owners")

    jobs.get_by_label("Search jobs").fill("tank 99")
    expect(heading).to_contain_text("110")  # 99, 990 to 999, 9900 to 9998
    jobs.get_by_label("Status", exact=True).select_option("failed")
    jobs.get_by_label("Sort by").select_option("cost")
    expect(rows.first).to_contain_text("Tank 9998")
    jobs.get_by_role("button", name="Highest first").click()
    expect(rows.first).to_contain_text("Tank 992")
    assert "search=tank+99" in page.url
    assert "status=failed" in page.url
    page.reload()
    expect(rows.first).to_contain_text("Tank 992")

    before = int(heading.inner_text().split()[-1])
    rows.nth(0).get_by_role("checkbox").click()
    rows.nth(2).get_by_role("checkbox").click(modifiers=["Shift"])
    several = jobs.get_by_role("group", name="Selected jobs")
    expect(several).to_contain_text("3 jobs selected")
    expect(several.get_by_role("button", name="Pause")).to_be_disabled()
    several.get_by_label("Priority").fill("80")
    several.get_by_role("button", name="Set").click()
    expect(several).to_contain_text("3 of 3 jobs done.")
    several.get_by_role("button", name="Remove").click()
    question = page.get_by_role("dialog", name="Remove 3 jobs?")
    expect(question).to_contain_text("3 finished frames")
    question.get_by_role("button", name="Remove the jobs").click()
    expect(heading).to_have_text(f"Jobs {before - 3}")


def test_open_jobs_change_places_by_keys_and_by_dragging(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    farm.studio.hold()
    ids = {title: farm.submit(title=title) for title in ("First", "Second", "Third")}
    log_in()
    page.goto(f"{farm.url}/#/?sort=work")
    rows = page.locator(".jobs li")
    expect(rows).to_contain_text(["First", "Second", "Third"])
    handle = page.get_by_role("button", name="Place of Third")
    handle.focus()
    page.keyboard.press("Alt+ArrowUp")
    question = page.get_by_role("dialog", name="Change 2 priorities?")
    expect(question.get_by_role("listitem")).to_have_text(["First: 50 → 61", "Third: 50 → 61"])
    question.get_by_role("button", name="Change").click()
    expect(rows).to_contain_text(["First", "Third", "Second"])
    expect(page.get_by_text("Third is number 2 with priority 61.")).to_be_visible()
    expect(handle).to_be_focused()

    start = page.get_by_role("button", name="Place of Second").bounding_box()
    assert start is not None
    x, y = start["x"] + 10, start["y"] + 20
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x, y - 156, steps=4)
    expect(rows.first).to_have_class("before")
    page.mouse.up()
    expect(rows).to_contain_text(["Second", "First", "Third"])
    priorities = {title: farm.service.client.get(f"/jobs/{job_id}").json()["priority"] for title, job_id in ids.items()}
    assert priorities == {"First": 61, "Second": 72, "Third": 61}


def test_the_order_stays_under_the_pointer_until_it_leaves(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    farm.studio.hold()
    first = farm.submit(title="First")
    log_in()
    rows = page.locator(".jobs li")
    expect(rows.first).to_contain_text("First")
    rows.first.hover()
    farm.submit(title="Second")
    expect(page.get_by_text("The list has changed.")).to_be_visible()
    expect(rows.first).to_contain_text("First")
    page.mouse.move(900, 500)
    expect(rows.first).to_contain_text("Second")
    expect(page.get_by_text("The list has changed.")).to_have_count(0)
    assert first in page.url  # The open job stays open.
