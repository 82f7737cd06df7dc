"""Frames on a Looking Glass panel: what its bridge is sent, and what the page says."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.views import centre
from lippmann.plan import artifact_names as names
from tests.browser.conftest import Farm, Watch
from tests.browser.panel import PANEL_IS_AWAY, PanelBridge, Shown
from tests.browser.studio import LENSES, PX, coded_view
from tests.waiting import until
from worker.images.colour import srgb_codes

SQUARE = CellLayout(LENSES, LENSES, PX)
COLUMNS, ROWS = 4, 2


@pytest.fixture
def panel() -> Iterator[PanelBridge]:
    bridge = PanelBridge()
    yield bridge
    bridge.stop()


def _check_tiles(shown: Shown, frame: int) -> None:
    """Check that tile i, from the lower left to the right and then upward, is view i of the middle row."""
    assert shown.settings == {"vx": COLUMNS, "vy": ROWS, "vtotal": PX, "aspect": 1}
    quilt = np.asarray(Image.open(io.BytesIO(shown.png)).convert("RGB")).astype(int)
    assert quilt.shape == (ROWS * LENSES, COLUMNS * LENSES, 3)
    for tile in range(PX):
        row, col = ROWS - 1 - tile // COLUMNS, tile % COLUMNS
        seen = quilt[row * LENSES : (row + 1) * LENSES, col * LENSES : (col + 1) * LENSES]
        expected = srgb_codes(coded_view(SQUARE, frame, tile, centre(SQUARE)[1])).astype(int)
        assert np.abs(seen - expected).max() <= 2, f"tile {tile}"


def test_a_panel_shows_the_frames_of_the_viewer_as_quilts_and_the_page_says_what_goes_wrong(
    page: Page, farm: Farm, panel: PanelBridge, watch: Watch, log_in: Callable[[], Page]
) -> None:
    job_id = farm.submit(frames="1-2", outputs=[])
    own = farm.submit(frames="1", outputs=[{"kind": "quilt", "columns": 8}])
    until(lambda: farm.service.status(job_id) == farm.service.status(own) == "done")
    log_in()
    page.evaluate("hash => { location.hash = hash; }", f"#/jobs/{job_id}?frame=1")
    viewer = page.get_by_role("region", name="Picture")
    cast, stage = viewer.get_by_role("button", name="Cast"), page.locator(".stage")
    expect(page.locator(".stage canvas[aria-busy=false]")).to_be_visible()
    assert panel.commands == []  # Nobody is asked before the button is pressed.
    cast.click()
    expect(viewer.get_by_role("status", name="Panel")).to_have_text(
        "On the panel: frame 1, a quilt of 4 \u00d7 2 views."
    )
    _check_tiles(panel.shown[-1], 1)
    stage.focus()
    page.keyboard.press("PageDown")
    expect(viewer.get_by_role("status", name="Panel")).to_contain_text("frame 2")
    _check_tiles(panel.shown[-1], 2)
    cast.click()
    expect(cast).to_have_attribute("aria-pressed", "false")
    until(lambda: panel.commands[-1] == "wipe")

    page.evaluate("hash => { location.hash = hash; }", f"#/jobs/{own}")
    expect(page.get_by_role("img", name="Frame 1")).to_be_visible()
    cast.click()
    expect(viewer.get_by_role("status", name="Panel")).to_contain_text("frame 1, a quilt of 8 \u00d7 1 views")
    name = names.job_artifact(own, "exports/quilt/0001_qs8x1a1.png")
    assert panel.shown[-1].png == farm.service.parts.store.get_bytes(name)
    cast.click()

    panel.error = PANEL_IS_AWAY
    cast.click()
    expect(viewer.get_by_role("alert")).to_have_text("No Looking Glass panel is connected.")
    expect(cast).to_have_attribute("aria-pressed", "false")
    panel.stop()
    cast.click()
    expect(viewer.get_by_role("alert")).to_contain_text("Is Looking Glass Bridge running?")
    assert all("WebSocket" in text for text in watch.complaints)
    watch.complaints.clear()
