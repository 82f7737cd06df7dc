"""Frames as they appear, one of them large, and the finished videos."""

from __future__ import annotations

import re
import zipfile
from collections.abc import Callable

import pytest
from playwright.sync_api import APIResponse, Locator, Page, Route, expect

from tests.browser.conftest import Farm
from tests.browser.studio import LENSES, PX
from tests.waiting import until

NATURAL_PX = "picture => picture.complete && picture.naturalWidth"


@pytest.fixture
def done_job(farm: Farm) -> str:
    job_id = farm.submit()
    until(lambda: farm.service.status(job_id) == "done")
    return job_id


def _shown_px(picture: Locator) -> int:
    return int(until(lambda: picture.evaluate(NATURAL_PX)))


def test_thumbnails_appear_as_frames_finish(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    farm.studio.hold()
    farm.submit()
    log_in()
    cells = page.locator(".frames .cell")
    pictures = page.locator(".frames .cell.done img")
    expect(cells).to_have_count(6)
    expect(pictures).to_have_count(0)
    expect(page.locator(".frames .cell.rendering").first).to_be_visible()
    farm.studio.let(8)  # At least one frame's render and assembly, and not all of them.
    expect(pictures.first).to_be_visible()
    assert _shown_px(pictures.first) == LENSES * PX
    assert pictures.count() < 6
    farm.studio.let(100)
    expect(pictures).to_have_count(6)


def test_the_frame_under_the_pointer_stays_while_newer_ones_are_done(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    job = f"/jobs/{farm.submit_held()}"
    log_in()
    shown = page.locator(".looker .said .numbers")

    def has_frame() -> bool:
        farm.studio.let()
        return bool(farm.service.client.get(job).json()["frames_done"])

    until(has_frame, every_s=0.5)
    expect(page.locator(".stage canvas:not(.empty)")).to_be_visible()
    page.locator(".stage").hover()
    first = shown.inner_text()
    farm.studio.let(100)
    expect(page.locator(".frames .cell.done")).to_have_count(6)
    assert shown.inner_text() == first
    page.locator(".job h1").hover()
    expect(shown).to_contain_text("Frame 6")
    assert not first.startswith("Frame 6")


def test_a_frame_that_ends_while_the_frames_are_on_their_way_is_shown(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    job_id = farm.submit_held()
    late: list[tuple[Route, APIResponse]] = []
    page.route("**/frames?*", lambda route: late.append((route, route.fetch())), times=1)
    log_in()
    until(lambda: page.evaluate("1") and late)
    heading = page.get_by_role("heading", name="Frames")
    farm.studio.let(7)
    expect(heading).to_contain_text(re.compile("[1-5] of 6"))  # The events came; the answer is on its way.
    ((route, answer),) = late
    assert {item["status"] for item in answer.json()["items"]} <= {"waiting", "rendering"}
    with page.expect_response("**/frames?*"):
        route.fulfill(response=answer)
    expect(page.locator(".frames .cell.done img").first).to_be_visible()
    assert farm.service.status(job_id) == "running"


@pytest.mark.usefixtures("done_job")
def test_a_sheet_is_shown_down_to_one_cell_and_frames_play(page: Page, log_in: Callable[[], Page]) -> None:
    log_in()
    viewer, stage = page.get_by_role("region", name="Picture"), page.locator(".stage")
    expect(page.get_by_role("img", name="Frame 6")).to_be_visible()  # The newest, by itself.
    page.get_by_role("button", name="Frame 2, show large").click()
    expect(viewer).to_contain_text("Frame 2")
    stage.focus()
    page.keyboard.press("4")
    sheet = page.get_by_role("img", name="Frame 2, sheet")
    assert _shown_px(sheet) == LENSES * PX
    expect(sheet).to_have_css("image-rendering", "pixelated")
    expect(viewer).to_contain_text("Orthoscopic, 96 \u00d7 96 px")
    page.get_by_role("button", name="One cell").click()
    until(lambda: _width(sheet) > 0.7 * LENSES * min(_width(stage), _height(stage)))
    stage.focus()
    page.keyboard.press("0")
    until(lambda: _height(sheet) == _height(stage))
    page.keyboard.press("PageDown")
    expect(page.get_by_role("img", name="Frame 3, sheet")).to_be_visible()
    page.go_back()  # To where another mode was chosen,
    expect(page.get_by_role("img", name="Frame 2, looked around")).to_be_visible()
    page.get_by_role("button", name="Play").click()
    page.wait_for_url("**frame=4**")
    page.get_by_role("button", name="Pause").click()
    page.keyboard.press("f")
    until(lambda: page.evaluate("document.fullscreenElement?.className.includes('looker')"))
    page.keyboard.press("f")
    until(lambda: page.evaluate("document.fullscreenElement === null"))


def _width(shown: Locator) -> float:
    return float(shown.evaluate("shown => shown.getBoundingClientRect().width"))


def _height(shown: Locator) -> float:
    return float(shown.evaluate("shown => shown.getBoundingClientRect().height"))


def test_finished_videos_play_and_all_can_be_taken_home(page: Page, done_job: str, log_in: Callable[[], Page]) -> None:
    log_in()
    for title in ("All views", "Centre view"):
        video = page.get_by_label(title)
        assert video.evaluate("video => video.loop && video.muted && video.controls")
        video.evaluate("video => video.play()")
        until(lambda video=video: video.evaluate("video => video.currentTime > 0 && video.videoWidth") == 240)
    with page.expect_download() as taken:
        page.get_by_role("link", name="orthoscopic.mkv").click()
    assert taken.value.suggested_filename == f"{done_job}-video-orthoscopic.mkv"
    assert taken.value.path().read_bytes()[:4] == b"\x1aE\xdf\xa3"


def test_videos_of_every_kind_play_and_files_of_other_outputs_can_be_taken_home(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    job_id = farm.submit(outputs=["stereo.mp4", "anaglyph.webm", "view_grid.png"])
    until(lambda: farm.service.status(job_id) == "done")
    log_in()
    for title in ("Stereo, side by side", "Anaglyph, red-cyan: anaglyph.webm"):
        video = page.get_by_label(title)
        video.evaluate("video => video.play()")
        until(lambda video=video: video.evaluate("video => video.currentTime > 0 && video.videoWidth") == 240)
    files = page.get_by_role("group", name="view_grid.png").get_by_role("link")
    expect(files).to_have_count(8)
    expect(files.first).to_have_text("view_grid.png")
    with page.expect_download() as taken:
        page.get_by_role("link", name="All files (.zip)").click()
    assert taken.value.suggested_filename == f"{job_id}-view_grid.png.zip"
    with zipfile.ZipFile(taken.value.path()) as archive:
        assert archive.testzip() is None
        pictures = [f"view_grid/{frame:04d}.png" for frame in range(1, 7)]
        assert archive.namelist() == ["view_grid.png.json", *pictures]
    with page.expect_download() as taken:
        page.get_by_role("link", name="0003.png").click()
    assert taken.value.path().read_bytes()[:4] == b"\x89PNG"


def test_a_long_sequence_is_shown_a_page_at_a_time(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    farm.studio.hold()
    farm.submit(frames="1-300")
    log_in()
    cells = page.locator(".frames .cell")
    expect(cells).to_have_count(120)
    page.get_by_role("button", name="Show more frames").click()
    expect(cells).to_have_count(240)
    expect(cells.last).to_contain_text("240")
