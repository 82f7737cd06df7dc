"""The page on a telephone: one thing at a time, and nothing wider than the screen."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.browser.conftest import Farm
from tests.waiting import until

PHONE = "Object.defineProperty(navigator, 'maxTouchPoints', {value: 5});"
TILT = "gamma => dispatchEvent(new DeviceOrientationEvent('deviceorientation', {gamma, beta: 40}))"
TOO_WIDE_PX = "document.documentElement.scrollWidth - window.innerWidth"


def test_list_job_and_form_are_shown_one_at_a_time_and_none_is_wider_than_the_screen(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    farm.submit(title="A title that is a good deal longer than a telephone is wide, and then goes on")
    page.set_viewport_size({"width": 360, "height": 740})
    log_in()
    row, main = page.locator(".jobs .row"), page.locator("#main")
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


def test_a_finger_and_a_tilt_turn_the_scene_two_fingers_zoom_and_the_stage_is_recorded(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    job_id = farm.submit(frames="1", outputs=[])
    until(lambda: farm.service.status(job_id) == "done")
    page.add_init_script(PHONE)
    page.emulate_media(reduced_motion="reduce")
    page.set_viewport_size({"width": 390, "height": 844})
    log_in()
    page.evaluate("id => { location.hash = `#/jobs/${id}`; }", job_id)
    expect(page.locator(".stage canvas[aria-busy=false]")).to_be_visible()
    assert page.evaluate(TOO_WIDE_PX) <= 0
    box = page.locator(".stage").bounding_box()
    assert box
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    fingers = page.context.new_cdp_session(page)

    def touch(kind: str, *points: tuple[float, float]) -> None:
        where = [{"x": across, "y": down, "id": number} for number, (across, down) in enumerate(points)]
        fingers.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": where})

    touch("touchStart", (x, y))
    for step in range(1, 7):
        touch("touchMove", (x + 10 * step, y))
    touch("touchEnd")
    page.wait_for_url("**x=-0.**")  # The eye goes to the left: the scene turns with the finger.
    touch("touchStart", (x - 20, y), (x + 20, y))
    touch("touchMove", (x - 40, y), (x + 40, y))
    touch("touchEnd")
    page.wait_for_url("**zoom=**")
    page.get_by_role("button", name="Tilt").click()
    eye = page.locator(".place circle")
    middle = 50
    for gamma in (0, 0, 10):
        page.evaluate(TILT, gamma)
        page.wait_for_timeout(100)
    until(lambda: float(eye.get_attribute("cx") or middle) < middle - 15)
    page.locator(".menu summary").click()
    page.get_by_role("button", name="Record").click()
    page.get_by_role("button", name="Tilt").click()
    page.keyboard.press("ArrowRight")
    with page.expect_download() as taken:
        page.get_by_role("button", name="Stop recording").click()
    assert taken.value.suggested_filename.startswith(f"{job_id}-1.")
