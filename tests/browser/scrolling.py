"""The work of a page while it is scrolled: CPU time of its main thread, which other programs do not lengthen."""

from __future__ import annotations

from playwright.sync_api import Locator, Page

LONGEST_STEP_MS = 50
"""A step that takes longer than this is seen to stutter."""
STEPS = 60
PARTS = 15
"""The steps are measured in parts, so that one part that stutters is not hidden by the others."""
_STEPS_OF_A_PART = """async (scrolled, [from, to, all]) => {
  for (let step = from; step < to; step++) {
    scrolled.scrollTop = (step / all) * scrolled.scrollHeight;
    await new Promise(requestAnimationFrame);
  }
  await new Promise(requestAnimationFrame);
}"""


def scroll(page: Page, scrolled: Locator) -> float:
    """Scroll from the first to the last row, and return the CPU time of a step in its slowest part, in ms."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def busy_s() -> float:
        metrics = {one["name"]: one["value"] for one in session.send("Performance.getMetrics")["metrics"]}
        return float(metrics["TaskDuration"])

    length, slowest_ms = STEPS // PARTS, 0.0
    for first in range(0, STEPS, length):
        before = busy_s()
        scrolled.evaluate(_STEPS_OF_A_PART, [first, first + length, STEPS - 1])
        slowest_ms = max(slowest_ms, 1000 * (busy_s() - before) / length)
    session.detach()
    return slowest_ms
