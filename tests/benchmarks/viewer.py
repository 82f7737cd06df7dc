"""The viewer of the dashboard in Chromium without a graphics card: the first picture, drags, the sway, and bytes."""

from __future__ import annotations

import shutil
import statistics
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from tests.browser.conftest import CHROMIUM_ARGS
from tests.farm import Farm, ended, farm_up

SMALL: dict[str, Any] = {"scene": "fish", "outputs": []}
"""8 x 8 views of 90 x 90."""
LARGE: dict[str, Any] = {
    "scene": "fish-mesh",
    "outputs": [],
    "rig": {"lens_array": {"count": [100, 100]}, "px_per_lens": 24},
}
"""24 x 24 views of 100 x 100."""
ROUNDS = 5
MOVES = 60
SWAY_S = 4
SIZE = {"width": 1366, "height": 768}
IS_VIEWS = ("/views.atlas", "/depth.map", "/look?")

START_WATCH = """window.shown_ms = null;
const look = () => {
  const canvas = document.querySelector(".stage canvas.whole:not(.empty)");
  if (canvas?.width && canvas.dataset.drawn) return (window.shown_ms = performance.now());
  requestAnimationFrame(look);
};
const draw = WebGL2RenderingContext.prototype.drawArrays;
WebGL2RenderingContext.prototype.drawArrays = function (...given) {
  draw.apply(this, given);
  this.canvas.dataset.drawn = "1";
};
requestAnimationFrame(look);"""
"""Notes when the graphics card has drawn the first picture and the next frame of the screen begins."""

DRAG = """async moves => {
  const stage = document.querySelector(".stage");
  const box = stage.getBoundingClientRect();
  const point = (k) => ({ clientX: box.x + box.width * (0.5 + 0.3 * Math.sin(k / 9)),
    clientY: box.y + box.height * (0.5 + 0.2 * Math.cos(k / 7)), pointerId: 1, pointerType: "mouse", button: 0,
    buttons: 1, bubbles: true, isPrimary: true });
  const frame = () => new Promise(requestAnimationFrame);
  stage.setPointerCapture = () => {};
  stage.dispatchEvent(new PointerEvent("pointerdown", point(0)));
  const gl = stage.querySelector("canvas.whole").getContext("webgl2");
  const took_ms = [];
  for (let k = 1; k <= moves; k++) {
    const begun_ms = performance.now();
    stage.dispatchEvent(new PointerEvent("pointermove", point(k)));
    await frame();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    took_ms.push(performance.now() - begun_ms);
  }
  stage.dispatchEvent(new PointerEvent("pointerup", point(moves)));
  return took_ms;
}"""
"""Drags the picture; returns for every move the time until it is painted, which reading a pixel waits for."""

SWAY = """seconds => new Promise(done => {
  const begun_ms = performance.now();
  let count = 0;
  const next = (now_ms) => {
    if (now_ms - begun_ms >= 1000 * seconds) return done((1000 * count) / (now_ms - begun_ms));
    count += 1;
    requestAnimationFrame(next);
  };
  requestAnimationFrame(next);
})"""


def first_picture(folder: Path) -> str:
    """Return the time from the address of a finished job to its picture, and the bytes of views before a movement."""
    with _viewer(folder, SMALL) as (context, address):
        took_ms, sizes = [], []
        for _ in range(ROUNDS):
            page = context.new_page()
            received = _received(page)
            page.add_init_script(START_WATCH)
            page.goto(address)
            took_ms.append(float(page.wait_for_function("() => window.shown_ms").json_value()))
            sizes.append(sum(received))
            page.close()
    return f"{statistics.median(took_ms) / 1000:.2f} s, {max(sizes) / 1000:.0f} kB"


def small_drag(folder: Path) -> str:
    """Return median and p95 from a move of the pointer to the paint, and frames a second of the sway; 8 x 8 views."""
    return _motion(folder, SMALL)


def large_drag(folder: Path) -> str:
    """Return the same of 24 x 24 views."""
    return _motion(folder, LARGE)


def _motion(folder: Path, spec: dict[str, Any]) -> str:
    with _viewer(folder, spec) as (context, address):
        page = context.new_page()
        page.goto(address)
        page.wait_for_selector(".stage canvas.whole:not(.empty)")
        fps = float(page.evaluate(SWAY, SWAY_S))
        page.evaluate(DRAG, 3)  # It has all views loaded.
        page.wait_for_selector(".stage canvas.whole[aria-busy=false]")
        took_ms = sorted(page.evaluate(DRAG, MOVES))
    p95_ms = took_ms[round(0.95 * (len(took_ms) - 1))]
    return f"{statistics.median(took_ms):.0f} ms, {p95_ms:.0f} ms, {fps:.0f} fps"


def _received(page: Page) -> list[int]:
    """Return a list that grows by the bytes of each answer with views."""
    received: list[int] = []

    def note(request: Any) -> None:
        if any(part in request.url for part in IS_VIEWS):
            received.append(request.sizes()["responseBodySize"])

    page.on("requestfinished", note)
    return received


@contextmanager
def _viewer(folder: Path, spec: dict[str, Any]) -> Iterator[tuple[BrowserContext, str]]:
    """Lend a browser that is logged in, and the address of a finished job on loopback."""
    with farm_up(folder / "data", env={"LIPPMANN_MITSUBA": "auto"}) as farm, sync_playwright() as playwright:
        job = ended(farm.client, farm.client.submit(spec).id)
        assert job.status == "done", job.error
        browser = playwright.chromium.launch(executable_path=_chromium(), args=CHROMIUM_ARGS)
        yield _logged_in(browser, farm), f"{farm.client.address.url}/#/jobs/{job.id}"
        browser.close()


def _logged_in(browser: Browser, farm: Farm) -> BrowserContext:
    context = browser.new_context(viewport=SIZE)  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(farm.client.address.url)
    page.get_by_label("API key").fill(farm.client.address.key)
    page.get_by_role("button", name="Log in").click()
    page.get_by_role("heading", name="Jobs").wait_for()
    page.close()
    return context


def _chromium() -> str:
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    assert program is not None, "expected Chromium, as `make setup-test` installs it"
    return program
