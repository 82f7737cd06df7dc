"""The work of a job: 10,000 frames by status, tiles, tasks, attempts, logs; the job file, and what may not be done."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image
from playwright.sync_api import Locator, Page, expect
from sqlalchemy import update

from lippmann.job.messages.orders import TaskKind, TileIndex
from lippmann.job.states import TaskStatus
from lippmann.plan import artifact_names as names
from service.db.tables import Task
from service.schemas.access import Role
from tests.browser.conftest import Farm
from tests.browser.scrolling import LONGEST_STEP_MS, scroll
from tests.waiting import until

NO_WEBGL = """const lend = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  return kind === "webgl2" ? null : lend.call(this, kind, ...more);
};"""
FRAMES = 10_000
DONE = 4_000


def test_ten_thousand_frames_are_one_smooth_grid_that_opens_them(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    job_id = farm.submit(frames=f"1-{FRAMES}", outputs=[], render={"tiles": [1, 1]})
    until(lambda: farm.service.status(job_id) == "running")
    with farm.service.state.database.writing() as session:
        done = (Task.job_id == job_id) & (Task.frame > FRAMES - DONE)
        session.execute(update(Task).where(done).values(status=TaskStatus.DONE))
    farm.studio.assemble_alike(job_id, range(FRAMES - DONE + 1, FRAMES + 1))
    log_in()
    grid = page.get_by_role("group", name="All frames by status")
    expect(grid.get_by_role("list")).to_contain_text("4,000 done")
    square = grid.get_by_role("slider", name="Frame")
    assert grid.locator("*").count() < 40
    assert scroll(page, page.locator("html")) < LONGEST_STEP_MS
    page.evaluate("scrollTo(0, 0)")
    square.focus()
    page.keyboard.press("End")
    expect(square).to_have_attribute("aria-valuetext", "Frame 10000, done")
    page.keyboard.press("Enter")
    expect(page.get_by_role("region", name="Frame 10000")).to_contain_text("assemble")
    assert "frame=10000" in page.url


def test_tiles_tasks_attempts_and_a_log_are_shown_while_a_job_runs(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    job_id = farm.submit(frames="1-2", outputs=[], render={"tiles": [2, 2]})
    until(lambda: farm.service.client.get(f"/jobs/{job_id}/attempts").json()["total"] >= 2)
    log_in()
    grid = page.get_by_role("group", name="All frames by status")
    grid.get_by_role("slider", name="Frame").click(position={"x": 5, "y": 5})
    frame = page.get_by_role("region", name="Frame 1")
    tiles = frame.get_by_role("list", name="Tiles").get_by_role("listitem")
    expect(tiles).to_have_count(4)
    expect(tiles.first).to_have_text("30\u202f%")
    task = farm.service.client.get(f"/jobs/{job_id}/tasks", params={"status": "running"}).json()["items"][0]
    name = names.log_name(TaskKind.RENDER, task["frame"], TileIndex(**task["tile"]), None, 1)
    farm.service.parts.store.put_bytes(names.job_artifact(job_id, name), b"Parsing 1 s\n")
    frame.get_by_role("button", name="Log of render · frame 1 · tile 0-0").click()
    log = page.get_by_role("region", name="Log of render")
    expect(log).to_contain_text("Parsing 1 s")
    farm.service.parts.store.put_bytes(names.job_artifact(job_id, name), b"Parsing 1 s\nRendering row 7\n")
    expect(log).to_contain_text("Rendering row 7")
    farm.service.client.post(f"/jobs/{job_id}/tasks/{task['id']}/restart").raise_for_status()
    farm.studio.let(100)
    expect(tiles.first).to_have_text("done")
    page.get_by_text("Attempts by worker").click()
    timeline = page.locator("details").filter(has_text="Attempts by worker")
    expect(timeline.get_by_role("img", name="w1: 12 attempts")).to_be_visible()
    expect(timeline.get_by_role("list")).to_have_text("done 11stopped 1")
    page.get_by_text("All tasks").click()
    page.get_by_label("Kind").select_option("assemble")
    expect(page.locator(".tasks").last.locator("tbody tr")).to_have_count(2)


def test_the_job_file_is_saved_and_a_removal_says_what_goes(
    page: Page, farm: Farm, log_in: Callable[..., Page]
) -> None:
    kept, removed = (farm.submit(title=title, frames="1", outputs=[]) for title in ("Kept", "Gone"))
    until(lambda: farm.service.status(kept) == farm.service.status(removed) == "done")
    log_in()
    page.get_by_role("link", name="Gone").click()
    with page.expect_download() as saved:
        page.get_by_role("button", name="Download", exact=False).first.click()
    assert json.loads(Path(saved.value.path()).read_text())["title"] == "Gone"
    expect(page.get_by_role("link", name="Run again changed")).to_have_attribute("href", f"#/new?from={removed}")
    page.get_by_role("button", name="Remove", exact=True).click()
    question = page.get_by_role("dialog", name="Remove this job?")
    expect(question).to_contain_text("1 finished frame")
    expect(question).to_contain_text("files")
    question.get_by_role("button", name="Remove the job").click()
    expect(page.get_by_role("heading", name="Kept")).to_be_visible()
    assert farm.service.client.get(f"/jobs/{removed}").status_code == 404
    page.goto("about:blank")  # A page that still asks would be refused, which the browser prints.
    page.context.clear_cookies()
    log_in(farm.service.new_key(Role.VIEWER))
    expect(page.get_by_text("Your key may look, and change nothing.")).to_be_visible()
    expect(page.get_by_role("button", name="Remove", exact=True)).to_have_count(0)
    expect(page.get_by_role("checkbox")).to_have_count(0)
    expect(page.get_by_role("link", name="Run again changed")).to_have_count(0)


def _open_two(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    one, other = (
        farm.submit(title=title, frames="1-2", fps=fps, outputs=[]) for title, fps in (("Slow", 8), ("Fast", 24))
    )
    until(lambda: farm.service.status(one) == farm.service.status(other) == "done")
    log_in()
    for title in ("Slow", "Fast"):
        page.get_by_role("checkbox", name=f"Select {title}").click()
    page.get_by_role("group", name="Selected jobs").get_by_role("link", name="Compare").click()


def _red(pictures: Locator) -> list[int]:
    """Return the red in the middle of each picture; it tells from which side the scene is seen."""
    seen = [Image.open(io.BytesIO(picture.screenshot())).getchannel("R") for picture in pictures.all()]
    return [np.asarray(red)[red.height // 2, red.width // 3].item() for red in seen]


def test_two_jobs_are_compared_by_one_eye_that_moves_over_both(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    _open_two(page, farm, log_in)
    pictures = page.get_by_role("img", name="Frame 2, looked around")
    expect(pictures).to_have_count(2)
    expect(page.locator("canvas[aria-busy=true]")).to_have_count(0)
    middle = _red(pictures)
    box = pictures.first.bounding_box()
    assert box
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - box["width"] / 3, y, steps=4)
    page.mouse.up()
    until(lambda: min(_red(pictures)) > max(middle) + 30)  # the other picture has followed the hand
    until(lambda: abs(_red(pictures)[0] - _red(pictures)[1]) <= 3)
    assert "x=" in page.url
    page.get_by_label("Eye across").fill("-1")
    until(lambda: max(_red(pictures)) < min(middle) - 30)
    page.get_by_role("radio", name="Focus").check()
    expect(page.get_by_role("img", name="Frame 2, focused")).to_have_count(2)
    page.get_by_label("Sharp at").fill("5")
    expect(page.get_by_text("Sharp at 5 mm")).to_be_visible()
    until(lambda: "look=focus" in page.evaluate("location.hash"))
    rows = page.get_by_role("region", name="Table of differences").locator("tbody tr")
    expect(rows.filter(has_text="fps")).to_contain_text("24")
    expect(rows).to_have_count(2)  # and the title


def test_without_webgl_two_jobs_are_compared_by_single_views(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    page.add_init_script(NO_WEBGL)
    _open_two(page, farm, log_in)
    expect(page.get_by_role("img", name="Frame 2, view 4, 4")).to_have_count(2)
    page.get_by_label("Eye across").fill("-1")
    expect(page.get_by_role("img", name="Frame 2, view 0, 4")).to_have_count(2)
    until(lambda: all(each.evaluate("picture => picture.complete") for each in page.locator(".eye img").all()))
    until(lambda: "x=-1" in page.evaluate("location.hash"))
    page.get_by_label("Frame 2").fill("0")
    expect(page.get_by_role("img", name="Frame 1, view 0, 4")).to_have_count(2)
