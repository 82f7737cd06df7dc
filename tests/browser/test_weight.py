"""The requests of the page before it shows anything, and their weight."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from playwright.sync_api import Browser, Page

from tests.browser.conftest import Farm

MOST_REQUESTS = 20
MOST_BYTES = 250_000
IS_PICTURE = re.compile(r"\.(png|webp|svg)|/poster")
LOADED = """() => {
  const paint = performance.getEntriesByName("first-contentful-paint")[0];
  const entries = [...performance.getEntriesByType("navigation"), ...performance.getEntriesByType("resource")];
  return paint && entries.map(({ name, startTime, transferSize }) =>
    ({ name, isBefore: startTime < paint.startTime, bytes: transferSize }));
}"""


def test_the_page_asks_for_few_files_and_they_are_light(
    chromium: Browser, farm: Farm, log_in: Callable[[], Page]
) -> None:
    context = chromium.new_context(storage_state=log_in().context.storage_state())  # A browser that has kept nothing.
    page = context.new_page()
    page.goto(f"{farm.url}/")
    page.get_by_role("heading", name="New job").wait_for()
    loaded: list[dict[str, Any]] = page.wait_for_function(LOADED).json_value()
    context.close()
    before = [entry["name"] for entry in loaded if entry["isBefore"]]
    weight = sum(entry["bytes"] for entry in loaded if not IS_PICTURE.search(entry["name"]))
    print(f"{len(before)} requests before the first paint, {weight} bytes without pictures")
    assert len(before) <= MOST_REQUESTS
    assert MOST_BYTES / 10 < weight <= MOST_BYTES
