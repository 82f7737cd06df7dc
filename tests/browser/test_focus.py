"""Focus by a click: a rendered fish at known depths, and of every depth of the slider the sharpest around the click."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Locator, Page, expect

from lippmann.lightfield.refocus.shift_and_sum import focal_stack
from lippmann.local.capture import capture
from lippmann.local.files.master import Master, read_master
from tests.browser.conftest import Farm
from tests.needs import needs_povray
from tests.unit.lippmann.lightfield.sheets import image_of
from tests.waiting import until
from worker.images.colour import srgb_codes

pytestmark = needs_povray

RIG = {"lens_array": {"count": [44, 60]}}
STEP_MM = 0.5
"""The step of the slider for this scene."""
PLACES = {"a fin": (14, 17), "the body": (23, 35), "the tail": (17, 53)}
"""The (row, col) of lenses under which the central view shows the fish."""


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Render the fish through the paper's lens, with its true depth."""
    out = tmp_path_factory.mktemp("fish")
    capture("fish", None, ["capture.depth=true", "rig.lens_array.count=[44,60]"], frame=1, out=out)
    return out


def sharpest_mm(master: Master, place: tuple[int, int], depths_mm: NDArray[np.float64]) -> float:
    """Return the depth of the highest contrast of 8-bit codes in 9 x 9 pixels around a place."""
    image = image_of(master.pixels, master.layout, focal_length_mm=master.rig.lens_array.focal_length_mm)
    row, col = place
    codes = srgb_codes(focal_stack(image, depths_mm.tolist()))[:, row - 4 : row + 5, col - 4 : col + 5].astype(float)
    contrast = (np.diff(codes, axis=1) ** 2).mean(axis=(1, 2, 3)) + (np.diff(codes, axis=2) ** 2).mean(axis=(1, 2, 3))
    return float(depths_mm[np.argmax(contrast)])


class FocusPage:
    """The viewer in focus, with what its slider says."""

    def __init__(self, page: Page) -> None:
        self.page, self.stage = page, page.locator(".stage")
        self.slider = page.get_by_role("slider", name="Depth")

    def depth_mm(self) -> float:
        return float(self.slider.input_value())

    def click(self, place: tuple[int, int]) -> None:
        """Click the middle of a pixel of the picture, which fills the stage in one direction."""
        rows, cols = RIG["lens_array"]["count"]
        box = self.stage.bounding_box()
        assert box
        scale = min(box["width"] / cols, box["height"] / rows)
        left, top = (box["width"] - cols * scale) / 2, (box["height"] - rows * scale) / 2
        self.stage.click(position={"x": left + (place[1] + 0.5) * scale, "y": top + (place[0] + 0.5) * scale})


@pytest.fixture
def open_focus(page: Page, farm: Farm, rendered: Path, log_in: Callable[[], Page]) -> Callable[..., FocusPage]:
    def go(query: str = "", **job: Any) -> FocusPage:
        job_id = farm.submit(rig=RIG, frames="1", outputs=[], **job)
        until(lambda: farm.service.status(job_id) == "done")
        for name in ("orthoscopic", "depth"):
            store, artifact = farm.studio.store, f"{job_id}/{name}/0001.exr"
            store.delete(artifact)
            store.put_file(artifact, rendered / name / "0001.exr")
        page.emulate_media(reduced_motion="reduce")
        log_in()
        page.goto(f"{farm.url}/#/jobs/{job_id}?look=focus{query}")
        expect(page.get_by_role("radio", name="Focus")).to_be_checked()
        return FocusPage(page)

    return go


def test_a_click_focuses_on_the_object_within_one_step_of_the_slider(
    open_focus: Callable[..., FocusPage], rendered: Path
) -> None:
    viewer = open_focus(capture={"depth": True})
    assert float(viewer.slider.get_attribute("step") or 0) == STEP_MM
    # It opens on the exact depth of the fish, and not on the paraxial one of 43.3 mm.
    assert viewer.depth_mm() == 37.5
    least, most = (float(viewer.slider.get_attribute(name) or "nan") for name in ("min", "max"))
    depths_mm = np.arange(least, most + STEP_MM / 2, STEP_MM)
    master = read_master(rendered / "orthoscopic/0001.exr")
    for place in PLACES.values():
        viewer.slider.evaluate(
            "slider => { slider.value = -20; slider.dispatchEvent(new Event('input', {bubbles: true})); }"
        )
        expect(viewer.stage.locator(".found")).to_be_empty()
        viewer.click(place)
        expect(viewer.stage.locator(".found")).to_contain_text("away in the scene")
        assert abs(viewer.depth_mm() - sharpest_mm(master, place, depths_mm)) <= STEP_MM
    clicked_mm = viewer.depth_mm()
    expect(viewer.page).to_have_url(re.compile(f"depth={clicked_mm:g}"))
    # The address alone opens the same focus.
    viewer.page.reload()
    expect(viewer.page.get_by_role("radio", name="Focus")).to_be_checked()
    assert viewer.depth_mm() == clicked_mm
    viewer.page.get_by_role("button", name="Depth map").click()
    expect(viewer.stage.get_by_text("true depth", exact=True)).to_be_visible()
    until(lambda: viewer.stage.locator("canvas.depths").evaluate(OPAQUE) > 1000)
    expect(viewer.page).to_have_url(re.compile("map=1"))


OPAQUE = """canvas => canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data
  .filter((code, index) => index % 4 === 3 && code === 255).length"""


def test_without_a_captured_depth_the_pictures_tell_it(open_focus: Callable[..., FocusPage], rendered: Path) -> None:
    viewer = open_focus("&depth=-20")
    assert viewer.depth_mm() == -20
    viewer.click(PLACES["the body"])
    expect(viewer.stage.locator(".found")).to_contain_text("estimated")
    depths_mm = np.arange(-29, 51, STEP_MM)
    master = read_master(rendered / "orthoscopic/0001.exr")
    assert abs(viewer.depth_mm() - sharpest_mm(master, PLACES["the body"], depths_mm)) <= STEP_MM


def test_two_eyes_are_mixed_for_red_cyan_glasses_or_stand_side_by_side(open_focus: Callable[..., FocusPage]) -> None:
    page = open_focus().page
    page.get_by_role("radio", name="Look", exact=True).check()
    shown = page.get_by_role("img", name="Frame 1, looked around")
    until(lambda: bool(halves(shown).std() > 10))
    one_eye = colours_agree(halves(shown))
    page.get_by_role("radio", name="Side by side").check()
    page.get_by_label("Eyes apart").fill("120")
    expect(page).to_have_url(re.compile("eyes=side_by_side.*apart=120"))
    # The fish is in front of the display, so that it is further right for the left eye.
    left, right = until(lambda: there if (there := apart(halves(shown))) and there[0] > there[1] + 5 else None)
    page.get_by_role("radio", name="Cross-eyed").check()
    until(lambda: np.allclose(apart(halves(shown)) or (0, 0), (right, left), atol=4))
    page.get_by_role("radio", name="Red-cyan").check()
    expect(page).to_have_url(re.compile("eyes=anaglyph"))
    expect(page.get_by_text("of 8 views apart")).to_be_visible()
    # At edges red is no longer where green is.
    until(lambda: colours_agree(halves(shown)) < one_eye - 0.05)


def halves(shown: Locator) -> NDArray[np.float64]:
    return np.asarray(Image.open(io.BytesIO(shown.screenshot())).convert("RGB")).astype(float)


def apart(picture: NDArray[np.float64]) -> tuple[int, int] | None:
    """Return the places of the white stripe of the fish in the left and the right half, px; None if it is missing."""
    white = picture.min(axis=2) > 200
    halves = np.split(white[:, : white.shape[1] // 2 * 2], 2, axis=1)
    if not all(half.any() for half in halves):
        return None
    left, right = (round(float(np.nonzero(half)[1].mean())) for half in halves)
    return left, right


def colours_agree(picture: NDArray[np.float64]) -> float:
    edges = np.abs(np.diff(picture, axis=1))
    return float(np.corrcoef(edges[..., 0].ravel(), edges[..., 1].ravel())[0, 1])
