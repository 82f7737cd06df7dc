"""Every page in every state: axe has no moderate finding, nothing is wider than the screen, and nothing jumps.

`make screenshots` keeps the pictures of all states in out/screenshots, for people to look at.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, ViewportSize

from tests.browser.conftest import PATIENCE_MS, Farm, Watch
from tests.browser.states import SCREENS, STATES, Screen, Visit, settle
from tests.needs import missing
from tests.repository import ROOT

AXE = ROOT / "tests" / "page" / "node_modules" / "axe-core" / "axe.min.js"
HEAVY = {"moderate", "serious", "critical"}
MOST_SHIFT = 0.02
TOO_WIDE_PX = "document.documentElement.scrollWidth - window.innerWidth"
SHIFTS = """() => {
  window.shifts = [];
  const place = ({ x, y, width, height }) => `${x},${y} ${width}x${height}`;
  const name = (node) => node?.outerHTML?.slice(0, 60) ?? node?.parentElement?.outerHTML?.slice(0, 60) ?? "?";
  const moved = ({ node, previousRect: from, currentRect: to }) => `${name(node)}: ${place(from)} to ${place(to)}`;
  new PerformanceObserver((list) => {
    for (const { value, hadRecentInput, sources } of list.getEntries()) {
      if (!hadRecentInput) window.shifts.push({ value, moved: sources.map(moved) });
    }
  }).observe({ type: "layout-shift", buffered: true });
}"""


@pytest.fixture(scope="module")
def axe() -> str:
    """Return the program that examines a page: https://github.com/dequelabs/axe-core, locked in tests/page."""
    if not AXE.exists():
        missing("axe-core is not installed; `make page` installs it")
    return AXE.read_text(encoding="utf-8")


@pytest.mark.parametrize("screen", SCREENS, ids=lambda screen: screen.name)
def test_every_state_is_accessible_fits_the_screen_and_does_not_jump(
    chromium: Browser, farm: Farm, axe: str, screen: Screen, tmp_path: Path
) -> None:
    viewport = ViewportSize(width=screen.width, height=screen.height)
    context = chromium.new_context(viewport=viewport, color_scheme=screen.scheme, reduced_motion="reduce")
    context.add_init_script(f"({SHIFTS})()")
    page = context.new_page()
    page.set_default_timeout(PATIENCE_MS)
    watch = Watch(farm.url)
    watch.over(page)
    visit, found = Visit(page, farm), dict[str, list[str]]()
    pictures = Path(os.environ.get("LIPPMANN_SCREENSHOTS", tmp_path)).resolve()
    for name, arrange in STATES.items():
        arrange(visit)
        settle(page)
        found[name] = [*_findings(page, axe), *_layout(page)]
        page.screenshot(path=pictures / f"{name}-{screen.name}.png")
    context.close()
    print(json.dumps(found, indent=1))
    assert {name: faults for name, faults in found.items() if faults} == {}
    assert [text for text in watch.complaints if "404" not in text] == []
    assert watch.strangers == []


def _findings(page: Page, axe: str) -> list[str]:
    """Return what axe finds, with the elements."""
    page.evaluate(axe)
    result: dict[str, Any] = page.evaluate("() => axe.run(document, { resultTypes: ['violations'] })")
    heavy = [violation for violation in result["violations"] if violation["impact"] in HEAVY]
    return [
        f"{violation['id']}: {violation['help']}: {json.dumps([node['target'] for node in violation['nodes']])}"
        for violation in heavy
    ]


def _layout(page: Page) -> list[str]:
    found = []
    if (too_wide := page.evaluate(TOO_WIDE_PX)) > 0:
        found.append(f"{too_wide} px wider than the screen")
    shifts: list[dict[str, Any]] = page.evaluate("() => window.shifts")
    total = sum(shift["value"] for shift in shifts)
    if total > MOST_SHIFT:
        heaviest = max(shifts, key=lambda shift: float(shift["value"]))
        found.append(f"jumps by {total:.3f}, most by {'; '.join(heaviest['moved'])}")
    return found
