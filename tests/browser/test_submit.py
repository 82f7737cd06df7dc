"""A job submitted by hand, on the form that is drawn from the schema of the job file."""

from __future__ import annotations

import json
import re
import secrets
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from povtemplates.catalogue import scene_folders
from service.auth import create_key
from service.schemas.access import KeyLimits, Role
from tests.browser.conftest import Farm, Watch

REFUSAL = "the server responded with a status of 422"
MOST_CLS = 0.02
"""The most that a page may move by itself; the measure is the browser's cumulative layout shift."""
WATCH_SHIFTS = """() => {
  window.shift = 0;
  const add = (list) => list.getEntries().forEach((one) => { if (!one.hadRecentInput) window.shift += one.value; });
  new PerformanceObserver(add).observe({ type: "layout-shift", buffered: true });
}"""


def test_preset_scene_fields_outputs_and_the_job_file_become_a_job(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    log_in()
    panel = page.get_by_role("button", name="Panel at 203 dpi")
    panel.click()
    expect(panel).to_have_attribute("aria-pressed", "true")
    expect(page.get_by_label("DPI")).to_have_value("203")
    # What the job does not say is shown as what counts: the array's substrate.
    page.get_by_text("More: rig, lens array, camera, capture").click()
    expect(page.get_by_label("Substrate mm")).to_have_value("3.3")
    page.get_by_role("radio", name="none").nth(1).check()
    page.get_by_label("Point target").check(force=True)
    page.get_by_label("Frames", exact=True).fill("1-4:3")
    lenses = page.get_by_role("group", name="Lenses")
    lenses.get_by_label("Rows").fill("10")
    lenses.get_by_label("Columns").fill("12")
    page.get_by_label("Pixels per lens", exact=True).fill("4")
    page.get_by_label("Offset mm").fill("-5.5")
    page.get_by_role("button", name="Remove sheets").click()
    page.get_by_label("One more of the outputs").select_option("view_grid")
    page.get_by_role("button", name="Add").click()
    page.get_by_text("Job file", exact=True).click()
    text = page.get_by_label("Job file as JSON")
    written = json.loads(text.input_value())
    assert written == {
        "scene": "target-points",
        "title": "Panel at 203 dpi",
        "frames": "1-4:3",
        "rig": {
            "lens_array": {"preset": "fresnel-technologies-630", "count": [10, 12], "offset_mm": -5.5},
            "px_per_lens": 4,
        },
        "outputs": [{"kind": "views"}, {"kind": "view_grid"}],
    }
    # The other way: what is written there is in the form.
    text.fill("{")
    expect(page.get_by_text("This is not JSON yet")).to_be_visible()
    text.fill(json.dumps(written | {"priority": 80, "title": "Points"}))
    expect(page.get_by_label("Priority")).to_have_value("80")
    expect(page.get_by_label("Pixels per lens", exact=True)).to_have_value("4")
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_role("heading", level=1, name="Points")).to_be_visible()
    (job,) = farm.service.client.get("/jobs").json()["items"]
    assert job["frames"] == {"count": 2, "text": "1-4:3"}
    assert job["size"] == {"rows": 40, "cols": 48, "lens_rows": 10, "lens_cols": 12, "px_per_lens": 4}
    assert job["spec"]["rig"]["lens_array"]["offset_mm"] == -5.5
    assert [output["kind"] for output in job["spec"]["outputs"]] == ["views", "view_grid"]
    assert (job["spec"]["scene"], job["priority"]) == ("target-points", 80)
    # The stored job fills the form again.
    page.goto(f"{farm.url}/#/new?from={job['id']}")
    expect(page.get_by_label("Title")).to_have_value("Points")
    expect(lenses.get_by_label("Columns")).to_have_value("12")
    expect(page.get_by_label("Point target")).to_be_checked()


def test_a_folder_becomes_a_scene_and_what_is_refused_is_said_with_the_reason(
    page: Page, watch: Watch, log_in: Callable[[], Page], tmp_path: Path
) -> None:
    log_in()
    points = scene_folders()["target-points"]
    folder = page.get_by_label("A folder with a scene")
    folder.set_input_files(points)
    expect(page.get_by_text("is built in; choose another name")).to_be_visible()
    page.get_by_label("A zip with a scene").set_input_files(
        {"name": "holiday.zip", "mimeType": "application/zip", "buffer": b"no zip"}
    )
    expect(page.get_by_text("expected a zip")).to_be_visible()
    shutil.copytree(points, tmp_path / "My points")
    folder.set_input_files(tmp_path / "My points")
    expect(page.get_by_text("is uploaded as my-points.")).to_be_visible()
    expect(page.get_by_role("radio", name="Point target").first).to_be_checked()
    page.get_by_text("Job file", exact=True).click()
    expect(page.get_by_label("Job file as JSON")).to_have_value(re.compile('"scene": "my-points"'))
    assert all("the server responded with a status of 4" in text for text in watch.complaints)
    watch.complaints.clear()


@pytest.mark.parametrize("body_limit_mb", [1.0])
def test_a_zip_that_is_too_large_or_unpacks_to_too_much_is_refused_with_the_limit_and_the_next_is_taken(
    page: Page, watch: Watch, log_in: Callable[[], Page], tmp_path: Path
) -> None:
    log_in()
    choose = page.get_by_label("A zip with a scene")
    with (tmp_path / "huge.zip").open("wb") as file:
        file.truncate(257 * 2**20)  # The page refuses it by its size alone.
    choose.set_input_files(tmp_path / "huge.zip")
    expect(page.get_by_text("A scene has at most 256 MiB, and this has 257 MiB.")).to_be_visible()
    assert watch.complaints == []
    (tmp_path / "large.zip").write_bytes(secrets.token_bytes(8_000_000))  # More than the service takes.
    choose.set_input_files(tmp_path / "large.zip")
    # The service answers at once and hangs up; whether the browser reads the answer before is the network's affair.
    expect(
        page.get_by_text(re.compile("expected at most 1000000 bytes|8 MB was cut; it may be too large"))
    ).to_be_visible()
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as bomb:
        bomb.writestr("scene.pov", bytes(65 * 2**20))
    choose.set_input_files(tmp_path / "bomb.zip")
    expect(page.get_by_text("expected at most 100 times the packed size")).to_be_visible()
    watch.complaints.clear()
    shutil.copytree(scene_folders()["target-points"], tmp_path / "small points")
    page.get_by_label("A folder with a scene").set_input_files(tmp_path / "small points")
    expect(page.get_by_text("is uploaded as small-points.")).to_be_visible()
    assert watch.complaints == []


def test_a_parameter_of_the_scene_is_sent_as_the_number_it_is(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    log_in()
    page.get_by_label("Ripple mm").fill("0.75")
    expect(page.get_by_label("Ripple, slider")).to_have_value("0.75")
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_role("complementary", name="Rig")).to_contain_text("0.75")
    assert farm.service.client.get("/jobs").json()["items"][0]["spec"]["parameters"] == {"ripple": 0.75}


def test_a_number_gets_keyframes_by_keys_pointer_and_text_and_the_job_has_them(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    log_in()
    page.get_by_role("button", name="Animate Offset").click()
    curve = page.get_by_role("group", name="Offset mm")
    first, last = (curve.get_by_role("slider", name=f"Offset, keyframe {number}") for number in (1, 2))
    first.press("Shift+ArrowUp")
    expect(first).to_have_attribute("aria-valuetext", "41 at frame 1")
    last.hover()
    page.mouse.down()
    box = curve.locator(".plot").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"], box["y"] + box["height"] + 50)  # No lower than the plot.
    page.mouse.up()
    expect(last).to_have_attribute("aria-valuetext", "-40 at frame 8")
    curve.get_by_role("button", name="Add a keyframe").click()
    curve.get_by_label("Offset, keyframe 2, value").fill("-10")
    curve.get_by_label("smooth").check()
    curve.get_by_label("Offset, keyframe 2, frame").fill("9")
    expect(curve).to_contain_text("expected frames that rise, got frame 8 after frame 9")
    curve.get_by_label("Offset, keyframe 2, frame").fill("4")
    expect(curve).not_to_contain_text("expected frames that rise")
    keyframes = [[1, 41], [4, -10], [8, -40]]
    page.get_by_text("Job file", exact=True).click()
    text = page.get_by_label("Job file as JSON")
    written = json.loads(text.input_value())
    assert written["rig"]["lens_array"]["offset_mm"] == {"keyframes": keyframes, "interpolation": "smooth"}
    written["rig"]["lens_array"]["offset_mm"]["keyframes"][1][0] = 5
    text.fill(json.dumps(written))
    expect(curve.get_by_label("Offset, keyframe 2, frame")).to_have_value("5")
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_role("complementary", name="Rig")).to_be_visible()
    (job,) = farm.service.client.get("/jobs").json()["items"]
    animation = job["spec"]["animation"]["rig.lens_array.offset_mm"]
    assert animation == {"keyframes": [[1, 41.0], [5, -10.0], [8, -40.0]], "interpolation": "smooth"}


def test_what_is_wrong_is_said_at_its_field_before_anything_is_submitted_and_nothing_moves(
    page: Page, farm: Farm, watch: Watch, log_in: Callable[[str], Page]
) -> None:
    with farm.service.state.database.writing() as session:
        _, key = create_key(session, "small", Role.SUBMITTER, limits=KeyLimits(frames=100))
    log_in(key)
    page.evaluate(WATCH_SHIFTS)
    expect(page.get_by_role("region", name="Design")).to_contain_text("300.5 mm")
    fields = {
        "Frames": ("9-3", "a range that counts up"),
        "Pixels per lens": ("1", "got 1"),
        "Ripple mm": ("99", "expected number from 0.0 to 1.5, got 99"),
        "Offset mm": ("far", "a number"),
    }
    for name, (text, said) in fields.items():
        field = page.get_by_label(name, exact=True)
        before = field.input_value()
        field.fill(text)
        expect(field).to_have_attribute("aria-invalid", "true")
        expect(page.locator(f"[id='{field.get_attribute('aria-describedby')}']")).to_contain_text(said)
        field.fill(before)
        expect(field).not_to_have_attribute("aria-invalid", "true")
    offset = page.get_by_label("Offset mm")
    offset.fill("5000")
    expect(page.locator("[id='e-rig.lens_array.offset_mm']")).to_contain_text("stands behind the imaging lens")
    expect(page.get_by_text("The design is that before it.")).to_be_visible()
    offset.fill("40")
    expect(offset).not_to_have_attribute("aria-invalid", "true")
    limits = page.get_by_role("region", name="Limits")
    expect(limits).to_contain_text("Frames8 of 100")
    page.get_by_label("Frames", exact=True).fill("1-200")
    expect(page.get_by_text("The service refuses this job as it is.")).to_be_visible()
    expect(page.get_by_text("Frames: 200, and the limit is 100, set by your key.")).to_be_visible()
    expect(page.locator("[id='e-frames']")).to_contain_text("got 200")
    assert page.evaluate("window.shift") <= MOST_CLS
    assert watch.complaints == []  # A wrong value is an answer, not a failed request.
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_role("alert")).to_contain_text("Some fields need another look.")
    assert [REFUSAL in text for text in watch.complaints] == [True]
    watch.complaints.clear()


def test_a_form_that_was_begun_outlives_the_session_and_a_reload_and_ends_with_the_job(
    page: Page, farm: Farm, watch: Watch, log_in: Callable[[str], Page]
) -> None:
    farm.studio.hold()
    key = farm.service.new_key(Role.SUBMITTER)
    log_in(key)
    expect(page.get_by_text("This is the form as you left it.")).to_have_count(0)
    title = page.get_by_label("Title")
    title.fill("Half a job")
    page.get_by_label("Offset mm").fill("far")
    farm.service.client.delete(f"/keys/{key.split('_')[1]}").raise_for_status()
    expect(page.get_by_role("alert")).to_contain_text("Your session has ended")
    page.get_by_label("API key").fill(farm.key)
    page.get_by_role("button", name="Log in").click()
    expect(page.get_by_text("This is the form as you left it.")).to_be_visible()
    expect(title).to_have_value("Half a job")
    expect(page.get_by_label("Offset mm")).to_have_value("far")  # What cannot be submitted is kept as well.
    page.get_by_label("Offset mm").fill("40")
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_role("heading", level=1, name="Half a job")).to_be_visible()
    page.get_by_role("link", name="New job").click()
    expect(title).to_have_value("fish")
    expect(page.get_by_text("This is the form as you left it.")).to_have_count(0)
    title.fill("Another")
    page.reload()
    page.get_by_role("button", name="Begin again").click()
    expect(title).to_have_value("fish")
    title.fill("Mine")
    page.get_by_role("button", name="Log out").click()
    page.get_by_label("API key").fill(farm.service.new_key(Role.SUBMITTER))
    page.get_by_role("button", name="Log in").click()
    page.get_by_role("link", name="New job").click()
    expect(title).to_have_value("fish")
    assert all("the server responded with a status of 401" in text for text in watch.complaints)
    watch.complaints.clear()


def test_a_viewer_sees_why_nothing_can_be_submitted(page: Page, farm: Farm, log_in: Callable[[str], Page]) -> None:
    log_in(farm.service.new_key(Role.VIEWER))
    page.goto(f"{farm.url}/#/new")
    expect(page.get_by_text("Your key has the role viewer")).to_be_visible()
    expect(page.get_by_role("button", name="Submit")).to_be_disabled()
