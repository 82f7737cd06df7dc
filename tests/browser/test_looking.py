"""Looking into a frame: the views are coded, so the pixels of the canvas tell where the eye is and what is sharp."""

from __future__ import annotations

import io
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Locator, Page, expect

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, view_numbers
from tests.browser.conftest import Farm, Watch
from tests.browser.studio import BAR_MM, LENSES, PX, RIG, coded_view
from tests.waiting import until
from worker.images.colour import srgb_codes

SQUARE = CellLayout(LENSES, LENSES, PX)
HEXAGONAL = CellLayout(LENSES, LENSES, PX, lattice="hexagonal")
MISSING = sorted({(u, v) for u in range(HEXAGONAL.cell_cols) for v in range(HEXAGONAL.cell_rows)}
                 - set(view_numbers(HEXAGONAL)))  # fmt: skip

READ = """(canvas, [rows, cols]) => {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d");
  context.drawImage(canvas, 0, 0);
  const data = context.getImageData(0, 0, copy.width, copy.height).data;
  const at = (row, col) =>
    4 * (Math.floor((row + 0.5) * copy.height / rows) * copy.width + Math.floor((col + 0.5) * copy.width / cols));
  return Array.from({length: rows}, (_, row) =>
    Array.from({length: cols}, (_, col) => Array.from(data.slice(at(row, col), at(row, col) + 3))));
}"""
FRAMES_OF_THE_SCREEN = """async count => {
  for (let k = 0; k < count; k++) await new Promise(requestAnimationFrame);
}"""
NO_WEBGL = """const lend = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
  return kind === "webgl2" ? null : lend.call(this, kind, ...more);
};"""


class Viewer:
    """The large view of a job's first frame, and what its canvas shows."""

    def __init__(self, page: Page, layout: CellLayout) -> None:
        self.page, self.layout = page, layout
        self.stage = page.locator(".stage")

    @property
    def canvas(self) -> Locator:
        return self.stage.locator("canvas")

    def choose(self, name: str) -> None:
        self.page.get_by_role("button", name=name, exact=True).click()

    def pixels(self) -> NDArray[np.int64]:
        """Return the codes in the middle of every lens, `(rows, cols, 3)`."""
        return np.array(self.canvas.evaluate(READ, self.layout.square_size()))

    def shows(self, expected: NDArray[Any], *, within: int = 2) -> bool:
        return bool(np.abs(self.pixels() - expected).max() <= within)

    def drag(self, across_px: float, down_px: float) -> None:
        box = self.stage.bounding_box()
        assert box
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        self.page.mouse.move(x + across_px, y + down_px, steps=2)
        self.page.mouse.up()


def codes(layout: CellLayout, frame: int, u: int, v: int) -> NDArray[Any]:
    return srgb_codes(as_square(coded_view(layout, frame, u, v), layout)).astype(int)


@pytest.fixture
def open_frame(page: Page, farm: Farm, log_in: Callable[[], Page]) -> Callable[..., Viewer]:
    """Return how to open the first frame of a small job of some lattice."""

    def go(layout: CellLayout = SQUARE, *, moves: bool = False) -> Viewer:
        rig = RIG | {"lens_array": {"count": [LENSES, LENSES], "lattice": layout.lattice}}
        job_id = farm.submit(rig=rig, frames="1-2", outputs=[])
        until(lambda: farm.service.status(job_id) == "done")
        page.emulate_media(reduced_motion="no-preference" if moves else "reduce")
        page.set_viewport_size({"width": 900, "height": 600})  # Without a graphics card every pixel costs.
        log_in()
        page.get_by_role("button", name="Frame 1, show large").click()
        return Viewer(page, layout)

    return go


def test_keys_lead_from_view_to_view_and_stay_when_the_frame_changes(open_frame: Callable[..., Viewer]) -> None:
    viewer = open_frame()
    u, v = centre(SQUARE)
    viewer.choose("Look around")
    viewer.choose("Pixels")
    until(lambda: viewer.shows(codes(SQUARE, 1, u, v)))
    expect(viewer.page.get_by_role("application", name="Frame 1, looked around")).to_be_visible()
    viewer.page.keyboard.press("ArrowRight")
    viewer.page.keyboard.press("ArrowRight")
    viewer.page.keyboard.press("ArrowUp")
    until(lambda: viewer.shows(codes(SQUARE, 1, u + 2, v - 1)))
    viewer.page.keyboard.press("PageDown")
    until(lambda: viewer.shows(codes(SQUARE, 2, u + 2, v - 1)))
    expect(viewer.page.get_by_role("dialog", name="Frame 2")).to_contain_text(f"view {u + 2}, {v - 1} of 8 \u00d7 8")
    viewer.choose("Smooth")
    until(lambda: not viewer.shows(codes(SQUARE, 2, u + 2, v - 1)))


def test_a_drag_to_the_right_moves_the_eye_there_and_between_views_they_are_mixed(
    open_frame: Callable[..., Viewer],
) -> None:
    viewer = open_frame()
    u, v = centre(SQUARE)
    viewer.choose("Look around")
    viewer.choose("Pixels")
    until(lambda: viewer.shows(codes(SQUARE, 1, u, v)))
    viewer.drag(40, 0)
    first = codes(SQUARE, 1, u, v)[0, 0]
    until(lambda: viewer.pixels()[0, 0, 0] > first[0] + 2)
    mixed = viewer.pixels()[0, 0]
    assert mixed[0] not in [codes(SQUARE, 1, number, v)[0, 0, 0] for number in range(PX)]
    np.testing.assert_array_equal(mixed[1:], first[1:])
    viewer.drag(-1000, 1000)
    until(lambda: viewer.shows(codes(SQUARE, 1, 0, PX - 1)))


def test_where_a_hexagonal_lens_has_no_view_the_nearest_is_shown(open_frame: Callable[..., Viewer]) -> None:
    viewer = open_frame(HEXAGONAL)
    viewer.choose("Look around")
    viewer.choose("Pixels")
    until(lambda: viewer.shows(codes(HEXAGONAL, 1, *centre(HEXAGONAL))))
    corner = (HEXAGONAL.cell_cols - 1, 0)
    assert corner in MISSING
    viewer.drag(1000, -1000)
    away = {number: np.hypot(number[0] - corner[0], number[1] - corner[1]) for number in view_numbers(HEXAGONAL)}
    nearest = [number for number in away if away[number] == min(away.values())]
    until(lambda: any(viewer.shows(codes(HEXAGONAL, 1, *number)) for number in nearest))


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=["square", "hexagonal"])
def test_what_the_graphics_card_focuses_is_what_the_service_focuses(
    layout: CellLayout, farm: Farm, open_frame: Callable[..., Viewer]
) -> None:
    viewer = open_frame(layout)
    viewer.choose("Refocus")
    viewer.choose("Pixels")
    slider = viewer.page.get_by_label("Depth")
    shown = []
    for depth_mm in (BAR_MM, -7.5):
        slider.evaluate(
            "(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }", depth_mm
        )
        asked = viewer.page.get_by_role("link", name="PNG").get_attribute("href")
        assert asked is not None
        assert asked.endswith(f"/frames/1/refocus?depth_mm={slider.input_value()}")
        answer = farm.service.client.get(farm.url + asked)
        made = np.asarray(Image.open(io.BytesIO(answer.content)).convert("RGB")).astype(int)
        until(lambda made=made: viewer.shows(made))
        shown.append(viewer.pixels())
    assert shown[0][..., 2].max() > shown[1][..., 2].max() + 40
    viewer.stage.focus()
    viewer.page.keyboard.press("ArrowUp")
    expect(viewer.page.get_by_role("dialog")).to_contain_text("sharp at -7 mm")


def test_the_eye_sways_until_somebody_takes_over_and_not_at_all_for_who_wants_no_motion(
    open_frame: Callable[..., Viewer],
) -> None:
    viewer = open_frame(moves=True)
    viewer.choose("Look around")
    viewer.choose("Pixels")
    sway = viewer.page.get_by_role("button", name="Sway")
    expect(sway).to_have_attribute("aria-pressed", "true")
    before = until(lambda: viewer.pixels().tolist() if viewer.pixels().any() else None)
    until(lambda: viewer.pixels().tolist() != before)
    viewer.stage.click()
    viewer.page.keyboard.press("ArrowLeft")
    expect(sway).to_have_attribute("aria-pressed", "false")
    _stands_still(viewer)
    viewer.page.emulate_media(reduced_motion="reduce")
    viewer.page.reload()
    viewer.page.get_by_role("button", name="Frame 1, show large").click()
    viewer.choose("Look around")
    expect(sway).to_have_attribute("aria-pressed", "false")
    until(lambda: viewer.pixels().any())
    _stands_still(viewer)


def _stands_still(viewer: Viewer) -> None:
    viewer.page.evaluate(FRAMES_OF_THE_SCREEN, 3)
    before = viewer.pixels().tolist()
    viewer.page.evaluate(FRAMES_OF_THE_SCREEN, 20)
    assert viewer.pixels().tolist() == before


def test_without_webgl_and_when_it_is_lost_the_service_s_own_pictures_are_shown(
    page: Page, open_frame: Callable[..., Viewer]
) -> None:
    viewer = open_frame()
    u, v = centre(SQUARE)
    viewer.choose("Look around")
    until(lambda: viewer.pixels().any())
    viewer.canvas.evaluate("canvas => canvas.getContext('webgl2').getExtension('WEBGL_lose_context').loseContext()")
    expect(page.get_by_role("button", name="Sway")).to_have_count(0)
    until(lambda: viewer.shows(codes(SQUARE, 1, u, v), within=0))
    page.add_init_script(NO_WEBGL)
    page.reload()
    page.get_by_role("button", name="Frame 1, show large").click()
    viewer.choose("Look around")
    until(lambda: viewer.shows(codes(SQUARE, 1, u, v), within=0))
    page.keyboard.press("ArrowLeft")
    until(lambda: viewer.shows(codes(SQUARE, 1, u - 1, v), within=0))
    viewer.choose("Refocus")
    expect(page.get_by_role("img", name="Frame 1, refocused")).to_be_visible()
    until(lambda: viewer.pixels()[..., 0].std() < 2)  # All views are mixed: what tells them apart is gone.


def test_as_seen_asks_for_the_eyes_that_are_chosen_and_says_what_the_service_refuses(
    page: Page, watch: Watch, open_frame: Callable[..., Viewer]
) -> None:
    viewer = open_frame()
    viewer.choose("As seen")
    size = "canvas => canvas.width / canvas.height"
    until(lambda: viewer.canvas.evaluate(size) == 1)
    with page.expect_response("**/observer?*x=40*") as seen:
        page.get_by_label("right").fill("40")
    assert "stereo" not in seen.value.url
    viewer.choose("Side by side")
    until(lambda: viewer.canvas.evaluate(size) == 2)
    with page.expect_response("**/observer?*stereo=anaglyph*"):
        viewer.choose("Red-cyan")
    until(lambda: viewer.canvas.evaluate(size) == 1)
    body = '{"title": "Not found", "status": 404, "detail": "frame 1 is not assembled yet"}'
    page.route(
        "**/observer?*", lambda route: route.fulfill(status=404, body=body, content_type="application/problem+json")
    )
    viewer.stage.focus()
    page.keyboard.press("ArrowLeft")
    expect(page.get_by_role("alert")).to_have_text("frame 1 is not assembled yet")
    page.unroute_all()
    page.route("**/observer?*", lambda route: route.abort())
    page.keyboard.press("ArrowRight")
    expect(page.get_by_role("alert")).to_have_text("The service does not answer.")
    page.unroute_all()
    expect(page.get_by_role("alert")).to_have_count(0)  # It is asked again without anybody's doing.
    assert all("status of 404" in text or "ERR_FAILED" in text for text in watch.complaints)
    watch.complaints.clear()
