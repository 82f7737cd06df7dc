"""Looking into a frame: the views are coded, so the pixels of the canvas tell where the eye is and what is sharp."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from playwright.sync_api import Locator, Page, expect

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, grid_size, interlace, view_numbers, view_of_grid
from tests.browser.conftest import Farm, Watch
from tests.browser.studio import BAR_MM, LENSES, PX, RIG, coded_view
from tests.waiting import until
from worker.images.colour import srgb_codes
from worker.images.write import write_exr

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
  const times = Math.min(copy.width / cols, copy.height / rows);
  const [left, top] = [(copy.width - cols * times) / 2, (copy.height - rows * times) / 2];
  const at = (row, col) =>
    4 * (Math.floor(top + (row + 0.5) * times) * copy.width + Math.floor(left + (col + 0.5) * times));
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


OPENEXR = bytes.fromhex("762f3101")
"""The first bytes of an OpenEXR file."""


class Viewer:
    """The viewer of a job, and what its canvas shows."""

    def __init__(self, page: Page, layout: CellLayout) -> None:
        self.page, self.layout = page, layout
        self.stage = page.locator(".stage")

    @property
    def canvas(self) -> Locator:
        return self.stage.locator("canvas:not(.empty)")

    def choose(self, name: str) -> None:
        self.page.get_by_role("radio", name=name, exact=True).check()

    def pixels(self) -> NDArray[np.int64]:
        """Return the codes in the middle of every lens, `(rows, cols, 3)`."""
        return np.array(self.canvas.evaluate(READ, self.layout.square_size()))

    def shows(self, expected: NDArray[Any], *, within: int = 2) -> bool:
        return bool(np.abs(self.pixels() - expected).max() <= within)

    def bar_col(self) -> int:
        """Return the column of the bar that floats before the display."""
        return int(self.pixels()[0, :, 2].argmax())

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

    def go(
        layout: CellLayout = SQUARE,
        *,
        moves: bool = False,
        query: str = "pixels=1",
        sheet: NDArray[np.float32] | None = None,
    ) -> Viewer:
        rig = RIG | {"lens_array": {"count": [LENSES, LENSES], "lattice": layout.lattice}}
        job_id = farm.submit(rig=rig, frames="1-2", outputs=[])
        until(lambda: farm.service.status(job_id) == "done")
        if sheet is not None:
            _replace(farm, f"{job_id}/orthoscopic/0001.exr", sheet)
        page.emulate_media(reduced_motion="no-preference" if moves else "reduce")
        page.set_viewport_size({"width": 900, "height": 600})  # Without a graphics card every pixel costs.
        log_in()
        page.evaluate("hash => { location.hash = hash; }", f"#/jobs/{job_id}?frame=1&{query}")
        return Viewer(page, layout)

    return go


def _replace(farm: Farm, name: str, light: NDArray[np.float32]) -> None:
    with tempfile.NamedTemporaryFile(suffix=".exr") as file:
        write_exr(Path(file.name), light, attributes={})
        farm.studio.store.delete(name)
        farm.studio.store.put_file(name, Path(file.name))


def test_the_scene_follows_the_hand_and_a_link_shows_the_same_pixels(open_frame: Callable[..., Viewer]) -> None:
    viewer = open_frame()
    page, (u, v) = viewer.page, centre(SQUARE)
    until(lambda: viewer.shows(codes(SQUARE, 1, u, v)))
    near_col = viewer.bar_col()
    viewer.stage.focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowUp")
    until(lambda: viewer.shows(codes(SQUARE, 1, u - 2, v + 1)))  # The eye goes left and down,
    assert viewer.bar_col() == near_col + 2  # and what is near goes right, as the hand does.
    viewer.drag(40, 0)
    until(lambda: viewer.bar_col() > near_col + 2)
    mixed = viewer.pixels()[0, 0]
    assert mixed[0] not in [codes(SQUARE, 1, number, v)[0, 0, 0] for number in range(PX)], "between views"
    viewer.drag(1000, -1000)
    until(lambda: viewer.shows(codes(SQUARE, 1, 0, PX - 1)))
    page.keyboard.press("PageDown")
    until(lambda: viewer.shows(codes(SQUARE, 2, 0, PX - 1)))
    expect(page.locator(".looker")).to_contain_text(f"view 0, {PX - 1} of 8 \u00d7 8")
    viewer.choose("Smooth")
    for _ in range(3):
        page.keyboard.press("+")
    page.wait_for_url("**frame=2**zoom=1.95313**")
    shown = _steady(viewer)
    other = page.context.new_page()
    other.set_viewport_size({"width": 900, "height": 600})
    other.emulate_media(reduced_motion="reduce")
    other.goto(page.url)
    assert _steady(Viewer(other, SQUARE)) == shown
    other.close()


def _steady(viewer: Viewer) -> str:
    """Return the exact pixels once everything is loaded and at rest."""
    expect(viewer.stage.locator("canvas[aria-busy=false]")).to_be_visible()
    return str(until(lambda: _at_rest(viewer)))


def _at_rest(viewer: Viewer) -> str | None:
    before = viewer.canvas.evaluate("canvas => canvas.toDataURL()")
    viewer.page.evaluate(FRAMES_OF_THE_SCREEN, 20)
    viewer.page.wait_for_timeout(200)
    return str(before) if viewer.canvas.evaluate("canvas => canvas.toDataURL()") == before else None


def test_the_first_picture_is_asked_for_before_the_frames_are_listed(
    page: Page, farm: Farm, log_in: Callable[[], Page]
) -> None:
    job_id = farm.submit(rig=RIG, frames="1-2", outputs=[])
    until(lambda: farm.service.status(job_id) == "done")
    log_in()
    page.goto("about:blank")
    asked: list[str] = []
    page.on("request", lambda request: asked.append(urlsplit(request.url).path.partition(f"/jobs/{job_id}")[2]))
    page.goto(f"{farm.url}/#/jobs/{job_id}")
    expect(page.locator(".stage canvas:not(.empty)")).to_be_visible()
    assert asked.index("/frames/2/look") < asked.index("/frames")


def test_where_a_hexagonal_lens_has_no_view_the_nearest_is_shown(open_frame: Callable[..., Viewer]) -> None:
    corner = (HEXAGONAL.cell_cols - 1, 0)
    assert corner in MISSING
    viewer = open_frame(HEXAGONAL, query="pixels=1&x=1&y=-1")
    away = {number: np.hypot(number[0] - corner[0], number[1] - corner[1]) for number in view_numbers(HEXAGONAL)}
    nearest = [number for number in away if away[number] == min(away.values())]
    until(lambda: any(viewer.shows(codes(HEXAGONAL, 1, *number)) for number in nearest))


def _as_the_service_makes_it(viewer: Viewer, farm: Farm) -> NDArray[Any]:
    """Return the picture of the service that the viewer links."""
    viewer.page.locator(".menu summary").click()
    link = viewer.page.get_by_role("link", name="This picture, one pixel per lens (PNG)").get_attribute("href")
    viewer.page.locator(".menu summary").click()
    answer = farm.service.client.get(f"{farm.url}{link}")
    return np.asarray(Image.open(io.BytesIO(answer.content)).convert("RGB")).astype(int)


@pytest.mark.parametrize("layout", [SQUARE, HEXAGONAL], ids=["square", "hexagonal"])
def test_what_the_graphics_card_focuses_is_what_the_service_focuses(
    layout: CellLayout, farm: Farm, open_frame: Callable[..., Viewer]
) -> None:
    viewer = open_frame(layout, query="look=focus&pixels=1")
    page = viewer.page
    slider = page.get_by_label("Depth")
    shown = []
    for depth_mm in (BAR_MM, -7.5):
        slider.evaluate(
            "(slider, value) => { slider.value = value; slider.dispatchEvent(new Event('input')); }", depth_mm
        )
        made = _as_the_service_makes_it(viewer, farm)
        until(lambda made=made: viewer.shows(made))
        shown.append(viewer.pixels())
    assert shown[0][..., 2].max() > shown[1][..., 2].max() + 40


PFM = "image/x-portable-floatmap"
BAR_WIDTH, BAR_STEP = 2, 2
"""The width of a bar and how far it moves against the eye from view to view, in lenses."""


def _near_bar() -> NDArray[np.float32]:
    """Return a sheet with a blue bar so near that plain mixing of neighbouring views would show it twice."""
    grid = np.zeros((*grid_size(SQUARE), 3), dtype=np.float32)
    for u, v in view_numbers(SQUARE):
        seen = view_of_grid(grid, SQUARE, u, v)
        seen[..., 0] = 0.2
        first = LENSES // 2 - BAR_STEP * (u - PX // 2)
        seen[:, max(0, first) : max(0, first + BAR_WIDTH), 2] = 1
    return interlace(grid, SQUARE)


def _near_depths() -> bytes:
    """Return the depth map of its central view."""
    depths_mm = np.zeros((LENSES, LENSES), dtype="<f4")
    depths_mm[:, LENSES // 2 : LENSES // 2 + BAR_WIDTH] = BAR_STEP * BAR_MM
    return f"Pf\n{LENSES} {LENSES}\n-1.0\n".encode() + depths_mm.tobytes()


@pytest.mark.parametrize("u", [3.5, 3.25])
def test_between_views_a_near_bar_is_one_sharp_bar_where_it_is(
    u: float, page: Page, open_frame: Callable[..., Viewer]
) -> None:
    page.route("**/depth.map*", lambda route: route.fulfill(body=_near_depths(), content_type=PFM))
    x, y = (2 * number / (PX - 1) - 1 for number in (u, PX // 2))
    viewer = open_frame(query=f"pixels=1&x={x:.5f}&y={y:.5f}", sheet=_near_bar())
    expect(viewer.canvas).to_be_visible()
    _steady(viewer)
    codes = viewer.pixels()[LENSES // 2, :, 2] / 255
    light = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    middle = float((light * np.arange(LENSES)).sum() / light.sum())
    expected = LENSES // 2 + (BAR_WIDTH - 1) / 2 + BAR_STEP * (PX // 2 - u)
    assert abs(middle - expected) <= 0.25
    assert abs(light.sum() - BAR_WIDTH) <= 0.25
    assert np.count_nonzero(light > 0.05) <= BAR_WIDTH + 1, light.round(2)


def test_the_free_eye_sways_and_follows_the_pointer_until_somebody_takes_over(
    open_frame: Callable[..., Viewer],
) -> None:
    viewer = open_frame(moves=True)
    page = viewer.page
    follow = page.get_by_role("button", name="Follow")
    expect(follow).to_have_attribute("aria-pressed", "true")
    before = until(lambda: viewer.pixels().tolist() if viewer.pixels().any() else None)
    until(lambda: viewer.pixels().tolist() != before)
    box = viewer.stage.bounding_box()
    assert box
    page.mouse.move(box["x"] + box["width"] - 3, box["y"] + 3)
    until(lambda: viewer.shows(codes(SQUARE, 1, 0, PX - 1), within=40))  # It turns as a drag there turns it.
    page.mouse.down()
    page.mouse.up()
    expect(follow).to_have_attribute("aria-pressed", "false")
    page.mouse.move(5, 5)
    _steady(viewer)
    page.emulate_media(reduced_motion="reduce")
    follow.click()
    page.mouse.move(5, 5)
    _steady(viewer)


LOSE = """canvas => {
  window.loss = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
  window.loss.loseContext();
}"""


def test_without_webgl_and_while_it_is_lost_the_service_s_own_pictures_are_shown(
    page: Page, farm: Farm, open_frame: Callable[..., Viewer]
) -> None:
    viewer = open_frame(query="pixels=1&x=-0.2&y=0.1")
    u, v = 3, 4
    expect(viewer.canvas).to_be_visible()
    before, told = _steady(viewer), viewer.stage.locator(".told")
    expect(told).to_be_empty()
    viewer.canvas.evaluate(LOSE)
    expect(told).to_contain_text("lost the graphics card")
    expect(page.get_by_role("button", name="Follow")).to_have_count(0)
    until(lambda: viewer.shows(codes(SQUARE, 1, u, v), within=0))
    page.evaluate("window.loss.restoreContext()")
    expect(told).to_be_empty()
    until(lambda: viewer.canvas.count() == 1 and _steady(viewer) == before)
    # A mode that does not paint, opened meanwhile, does not keep the loss.
    viewer.canvas.evaluate(LOSE)
    expect(told).to_contain_text("lost the graphics card")
    viewer.choose("Sheet")
    viewer.choose("Look")
    until(lambda: viewer.canvas.count() == 1 and _steady(viewer) == before)
    page.add_init_script(NO_WEBGL)
    page.reload()
    expect(told).to_contain_text("Without WebGL2")
    until(lambda: viewer.shows(codes(SQUARE, 1, u, v), within=0))
    viewer.stage.focus()
    page.keyboard.press("ArrowRight")
    until(lambda: viewer.shows(codes(SQUARE, 1, u - 1, v), within=0))
    page.get_by_role("button", name="Play").click()
    page.wait_for_url("**frame=2**")
    page.get_by_role("button", name="Pause").click()
    viewer.choose("Focus")
    expect(page.get_by_role("img", name="focused")).to_be_visible()
    made = _as_the_service_makes_it(viewer, farm)
    until(lambda: viewer.shows(made, within=0))


def test_the_observer_asks_for_the_eyes_that_are_chosen_and_says_what_the_service_refuses(
    page: Page, farm: Farm, watch: Watch, open_frame: Callable[..., Viewer]
) -> None:
    viewer = open_frame(query="look=observer")
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
    page.locator(".menu summary").click()
    linear = page.get_by_role("link", name="This pair as two eyes see it (EXR)").get_attribute("href")
    assert farm.service.client.get(f"{farm.url}{linear}").content.startswith(OPENEXR)
    page.locator(".menu summary").click()
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
