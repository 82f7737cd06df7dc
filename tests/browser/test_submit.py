"""A job submitted by hand."""

from __future__ import annotations

from collections.abc import Callable

from playwright.sync_api import Page, expect

from tests.browser.conftest import Farm, Watch

REFUSAL = "the server responded with a status of 422"


def test_the_chosen_scene_frames_and_optics_become_a_job(page: Page, farm: Farm, log_in: Callable[[], Page]) -> None:
    farm.studio.hold()
    log_in()
    page.get_by_label("Point target").check(force=True)
    page.get_by_label("Frames", exact=True).fill("1-4:3")
    page.get_by_label("Lenses, rows").fill("10")
    page.get_by_label("Lenses, columns").fill("12")
    page.get_by_label("Pixels per lens").fill("4")
    page.get_by_label("Offset").fill("-5.5")
    expect(page.get_by_text("Integral image 48 \u00d7 40 px, 16 views of 12 \u00d7 10 px")).to_be_visible()
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_role("heading", level=1, name="target-points")).to_be_visible()
    (job,) = farm.service.client.get("/jobs").json()["items"]
    assert job["spec"]["scene"] == "target-points"
    assert job["frames"] == {"count": 2, "text": "1-4:3"}
    assert job["size"] == {"rows": 40, "cols": 48, "lens_rows": 10, "lens_cols": 12, "px_per_lens": 4}
    assert job["spec"]["rig"]["lens_array"]["offset_mm"] == -5.5


def test_a_parameter_of_the_scene_is_sent_as_the_number_it_is(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    farm.studio.hold()
    log_in()
    # By the keyboard: a click can miss while the drawing above arrives and moves the form.
    page.get_by_text("Parameters of the scene").press("Enter")
    page.get_by_label("ripple").fill("0.75")
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_role("complementary", name="Rig")).to_contain_text("0.75")
    assert farm.service.client.get("/jobs").json()["items"][0]["spec"]["parameters"] == {"ripple": 0.75}


def test_what_the_service_refuses_is_said_beside_its_field(
    page: Page, watch: Watch, log_in: Callable[[], Page]
) -> None:
    log_in()
    frames, px_per_lens, offset = (
        page.get_by_label(name, exact=True) for name in ("Frames", "Pixels per lens", "Offset mm")
    )
    frames.fill("9-3")
    px_per_lens.fill("1")
    offset.fill("far")
    page.get_by_role("button", name="Submit").click()
    for field, says in ((frames, "a range that counts up"), (px_per_lens, "got 1"), (offset, "a number")):
        expect(field).to_have_attribute("aria-invalid", "true")
        described_by = field.get_attribute("aria-describedby")
        expect(page.locator(f"[id='{described_by}']")).to_contain_text(says)
    assert all(REFUSAL in text for text in watch.complaints)
    watch.complaints.clear()


def test_what_is_wrong_with_a_parameter_is_said_beside_it(page: Page, watch: Watch, log_in: Callable[[], Page]) -> None:
    log_in()
    # By the keyboard: a click can miss while the drawing above arrives and moves the form.
    page.get_by_text("Parameters of the scene").press("Enter")
    page.get_by_label("ripple").fill("99")
    page.get_by_role("button", name="Submit").click()
    expect(page.get_by_label("ripple")).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_text("expected number from 0.0 to 1.5, got 99")).to_be_visible()
    assert all(REFUSAL in text for text in watch.complaints)
    watch.complaints.clear()
