"""The list of jobs, and what can be done with one of them; all without a reload."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import APIResponse, Page, Route, expect

from lippmann.job.messages.orders import TaskKind
from tests.browser.conftest import Farm
from tests.waiting import until

POVRAY_SAYS = "File 'scene.inc' line 41: Parse Error:\nundeclared identifier 'fish_lenght' found instead"


def test_a_job_appears_in_the_list_and_goes_on_to_its_end_without_a_reload(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    log_in()
    farm.studio.hold()
    farm.submit()
    row = page.get_by_role("link", name="A pond")
    expect(row).to_contain_text("running")
    expect(row).to_contain_text("0 / 6 frames")
    farm.studio.let(100)
    expect(row).to_contain_text("done")
    expect(row).to_contain_text("6 / 6 frames")
    assert row.get_by_role("progressbar").evaluate("bar => bar.value") == 1


def test_povrays_own_message_is_shown_with_the_failed_task_and_its_log(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.faults[TaskKind.RENDER, 2] = POVRAY_SAYS
    job_id = farm.submit()
    until(lambda: farm.service.status(job_id) == "failed")
    log_in()
    expect(page.get_by_role("region", name="Error").locator("pre")).to_have_text(POVRAY_SAYS)
    failures = page.get_by_role("region", name="Failed tasks")
    expect(failures).to_contain_text("render · frame 2")
    with page.context.expect_page() as opened:
        failures.get_by_role("link", name="Log").click()
    expect(opened.value.locator("body")).to_contain_text("fish_lenght")


def test_cancel_asks_first_and_then_ends_the_job(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    job_id = farm.submit_held()
    log_in()
    cancel = page.get_by_role("button", name="Cancel", exact=True)
    cancel.click()
    page.get_by_role("button", name="Keep the job").click()
    expect(page.get_by_role("dialog")).to_have_count(0)
    assert farm.service.status(job_id) == "running"
    cancel.click()
    page.get_by_role("button", name="Cancel the job").click()
    expect(page.locator(".job > header .badge")).to_have_text("cancelled")
    assert farm.service.status(job_id) == "cancelled"
    expect(page.get_by_role("button", name="Retry")).to_be_visible()


def test_a_job_is_paused_resumed_and_when_it_was_cancelled_retried(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    job_id = farm.submit_held()
    log_in()
    badge = page.locator(".job > header .badge")
    page.get_by_role("button", name="Pause").click()
    expect(badge).to_have_text("paused")
    page.get_by_role("button", name="Resume").click()
    expect(badge).to_have_text("running")
    farm.service.client.post(f"/jobs/{job_id}/cancel").raise_for_status()
    page.get_by_role("button", name="Retry").click()
    expect(badge).to_have_text("running")


def test_failed_frames_are_skipped_and_the_tiles_of_the_cache_are_counted(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.has_cache = True
    farm.studio.faults[TaskKind.RENDER, 2] = POVRAY_SAYS
    farm.submit_held()
    log_in()
    badge, facts = page.locator(".job > header .badge"), page.locator(".job .facts").first
    skip = page.get_by_role("button", name="Skip failed frames")
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    expect(skip).to_have_count(0)
    expect(facts).not_to_contain_text("cache")
    farm.studio.let(100)
    expect(badge).to_have_text("failed")
    skip.click()
    expect(badge).to_have_text("done")
    expect(facts).to_contain_text("5 tiles from the cache")


def test_an_answer_that_is_older_than_an_event_changes_nothing(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    job_id = farm.submit_held()
    log_in()
    late: list[tuple[Route, APIResponse]] = []
    page.route("**/pause", lambda route: late.append((route, route.fetch())))
    badge = page.locator(".job > header .badge")
    page.get_by_role("button", name="Pause").click()
    expect(badge).to_have_text("paused")  # The event says so; the answer is on its way.
    farm.service.client.post(f"/jobs/{job_id}/resume")
    expect(badge).to_have_text("running")
    ((route, answer),) = late
    assert answer.json()["status"] == "paused"
    with page.expect_response("**/pause"):
        route.fulfill(response=answer)
    farm.submit(title="later")
    expect(page.get_by_role("link", name="later")).to_be_visible()  # The page has drawn what came after the answer.
    assert badge.inner_text() == "running"


def test_a_job_that_somebody_removed_leaves_the_list(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    removed, kept = (farm.submit(title=title, frames="1", outputs=[]) for title in ("Removed", "Kept"))
    until(lambda: farm.service.status(kept) == farm.service.status(removed) == "done")
    log_in()
    # The viewer has asked for all that it wants before the job goes.
    with page.expect_response(f"**/{removed}/frames/1/views.atlas?max_px=4096*"):
        page.get_by_role("link", name="Removed").click()
    expect(page.get_by_role("heading", name="Removed")).to_be_visible()
    expect(page.locator(".frames .cell.done img")).to_be_visible()
    until(lambda: page.locator(".frames .cell.done img").evaluate("picture => picture.complete"))
    farm.service.client.delete(f"/jobs/{removed}").raise_for_status()
    expect(page.get_by_role("link", name="Removed")).to_have_count(0)
    expect(page.get_by_role("main").get_by_text("This job was removed.")).to_be_visible()
    expect(page.get_by_role("link", name="Kept")).to_be_visible()


def test_the_rig_and_the_notes_on_its_optics_are_told(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    farm.studio.hold()
    farm.submit()
    log_in()
    rig = page.get_by_role("complementary", name="Rig")
    for fact in ("12 \u00d7 12", "96 \u00d7 96 px", "40 mm", "athineos-2006", "The array stands"):
        expect(rig).to_contain_text(fact)


def test_the_page_says_why_a_job_and_its_tasks_wait(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    farm.studio.hold()
    busy = farm.submit(title="the first")
    until(lambda: farm.service.client.get(f"/jobs/{busy}").json()["tasks"]["dispatched"] >= 1)
    page.goto(farm.url)
    log_in()
    page.get_by_role("link", name="the first").click()
    page.get_by_text("Tasks that wait").click()
    expect(page.get_by_role("list", name="Tasks that wait")).to_contain_text("assemble · frame 1")
    expect(page.get_by_role("list", name="Tasks that wait")).to_contain_text("of the stage render/0001")
    page.get_by_role("button", name="Pause").click()
    expect(page.get_by_text("A user has paused the job.").first).to_be_visible()
