"""All frames of a long sequence in the viewer: address, slider, keys, play, and the film strip."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect
from sqlalchemy import update

from lippmann.job.states import TaskStatus
from service.db.tables import Task
from tests.browser.conftest import Farm
from tests.waiting import until

FRAMES, FIRST, FAILED = 200, 130, 165
"""Frames 130 to 200 are done but for one, and none of the first page of the list."""
MOST_SHOTS = 40


def _half_done_job(farm: Farm) -> str:
    farm.studio.hold()
    job_id = farm.submit(frames=f"1-{FRAMES}", outputs=[])
    until(lambda: farm.service.status(job_id) == "running")
    of_job = Task.job_id == job_id
    with farm.service.state.database.writing() as session:
        session.execute(update(Task).where(of_job & (Task.frame >= FIRST)).values(status=TaskStatus.DONE))
        session.execute(update(Task).where(of_job & (Task.frame == FAILED)).values(status=TaskStatus.FAILED))
    farm.studio.assemble_alike(job_id, range(FIRST, FRAMES + 1))
    return job_id


def test_every_frame_that_is_done_is_reached_and_the_others_say_what_they_are(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    job_id = _half_done_job(farm)
    log_in()
    viewer, stage = page.get_by_role("region", name="Picture"), page.locator(".stage")
    shown = stage.locator("canvas:not(.empty)")
    numbers = viewer.locator(".controls .numbers")

    def sees(frame: int) -> None:
        expect(numbers).to_contain_text(f"Frame {frame} \u00b7")
        expect(page.get_by_role("img", name=f"Frame {frame}, looked around")).to_have_attribute("aria-busy", "false")

    page.evaluate("hash => { location.hash = hash; }", f"#/jobs/{job_id}")
    sees(FRAMES)  # The newest one.
    stage.focus()
    page.evaluate("hash => { location.hash = hash; }", f"#/jobs/{job_id}?frame={FAILED - 1}")
    sees(FAILED - 1)
    page.keyboard.press("PageDown")
    sees(FAILED + 1)
    page.evaluate("hash => { location.hash = hash; }", f"#/jobs/{job_id}?frame=90")
    expect(stage).to_contain_text("Frame 90 is waiting.")
    expect(shown).to_have_count(0)
    expect(page.get_by_role("button", name="Previous frame")).to_be_disabled()
    page.keyboard.press("PageDown")
    sees(FIRST)
    slider = page.get_by_role("slider", name="Frame", exact=True).first
    slider.fill("20")
    sees(FIRST + 20)
    strip = page.get_by_role("listbox", name="All frames")
    shots = strip.get_by_role("option")
    expect(strip.get_by_role("option", selected=True)).to_have_attribute("aria-posinset", str(FIRST + 20))
    expect(strip.get_by_role("option", selected=True)).to_be_in_viewport()
    assert shots.count() < MOST_SHOTS
    strip.get_by_role("option", name=f"Frame {FIRST + 21}").click()
    sees(FIRST + 21)
    strip.focus()
    page.keyboard.press("ArrowRight")
    sees(FIRST + 22)
    page.keyboard.press("End")
    sees(FRAMES)
    strip.evaluate("(strip, part) => { strip.scrollLeft = part * strip.scrollWidth; }", (FAILED - 10) / FRAMES)
    expect(strip.get_by_role("option", name=f"Frame {FAILED}, failed")).to_have_attribute("aria-disabled", "true")
    strip.get_by_role("option", name=f"Frame {FAILED}, failed").click(force=True)
    sees(FRAMES)
    slider.fill("21")
    page.get_by_role("button", name="Play").click()
    page.wait_for_url(f"**frame={FIRST + 23}**")
    viewer.get_by_role("button", name="Pause").click()
