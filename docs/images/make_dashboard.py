"""Take dashboard-*.webp, the pictures of the dashboard, on a farm of its own.

Run it as `python docs/images/make_dashboard.py`. It starts a farm in a temporary folder, renders a short video, and
opens the pages in Chromium. It takes some minutes.
"""

from __future__ import annotations

import io
import shutil
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, sync_playwright

from lippmann.client import Client
from tests.farm import ended, farm_up

HERE = Path(__file__).parent
JOB: dict[str, Any] = {
    "scene": "fish-mesh",
    "title": "Fish over water",
    "frames": "1-4",
    "capture": {"depth": True},
    "rig": {"lens_array": {"count": [140, 140], "pitch_mm": 0.64, "focal_length_mm": 2.1}, "px_per_lens": 10},
}
WAIT_MS = 120_000


@dataclass(frozen=True)
class Shot:
    """One picture."""

    name: str
    fragment: str
    """The place in the dashboard; `{job}` stands for the id of the job."""
    ready: str
    """A selector of what must be there."""
    scheme: Literal["light", "dark"] = "light"
    size: tuple[int, int] = (1366, 900)
    click: tuple[float, float] | None = None
    """The place to click in the picture of the viewer, as parts of it."""


SHOTS: Sequence[Shot] = (
    Shot("look", "#/jobs/{job}?frame=3&x=0.3333&y=-0.1111", ".stage canvas:not(.empty)"),
    Shot("focus", "#/jobs/{job}?frame=3&look=focus&map=1", ".stage .legend", scheme="dark", click=(0.28, 0.5)),
    Shot("new-job", "#/new", "text=/lenses of .* px, in/"),
    Shot("farm", "#/farm", ".uplot"),
    Shot("phone", "#/jobs/{job}?frame=3&x=-0.3333&y=-0.1111", ".stage canvas:not(.empty)", size=(390, 844)),
)


def main() -> None:
    """Write the pictures."""
    with tempfile.TemporaryDirectory() as folder, farm_up(Path(folder)) as farm:
        job = farm.client.submit(JOB)
        ended(farm.client, job.id, within_s=1200.0)
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(
                executable_path=shutil.which("chromium"), args=["--no-sandbox", "--enable-unsafe-swiftshader"]
            )
            for shot in SHOTS:
                _take(browser, farm.client, job.id, shot)
            browser.close()


def _take(browser: Browser, client: Client, job_id: str, shot: Shot) -> None:
    width, height = shot.size
    context = browser.new_context(
        viewport=ViewportSize(width=width, height=height), color_scheme=shot.scheme, reduced_motion="reduce"
    )
    page = context.new_page()
    page.set_default_timeout(WAIT_MS)
    page.goto(client.login_link().url)
    page.wait_for_url("**/")
    home = page.url
    page.goto("about:blank")
    page.goto(home + shot.fragment.format(job=job_id))
    page.locator(shot.ready).first.wait_for()
    if shot.click:
        _click(page, *shot.click)
    page.wait_for_timeout(
        4000
    )  # The sharper pictures come one after the other, and say nothing when they are all there.
    with Image.open(io.BytesIO(page.screenshot())) as picture:
        picture.save(HERE / f"dashboard-{shot.name}.webp", quality=86, method=6)
    context.close()


def _click(page: Page, across: float, down: float) -> None:
    box = page.locator(".stage canvas").first.bounding_box()
    if box is None:
        raise RuntimeError("expected a picture in the viewer, got none")
    side = min(box["width"], box["height"])
    left, top = box["x"] + (box["width"] - side) / 2, box["y"] + (box["height"] - side) / 2
    page.mouse.click(left + across * side, top + down * side)


if __name__ == "__main__":
    main()
