"""A walk without a pointer: each stop has a ring and a name, none is a trap, and the focus is never lost."""

from __future__ import annotations

import re

from playwright.sync_api import Page, Route, expect

from tests.browser.conftest import Farm
from tests.waiting import until

MOST_STOPS = 160
STOP = """() => {
  const node = document.activeElement;
  const rings = [node, node.nextElementSibling, node.closest("label"), node.closest("label")?.nextElementSibling];
  const isRing = ({ outlineStyle, outlineWidth, boxShadow }) =>
    (outlineStyle !== "none" && parseFloat(outlineWidth) > 0) || boxShadow !== "none";
  return {
    lost: node === document.body,
    main: node.id === "main",
    ring: rings.some((one) => one && isRing(getComputedStyle(one))),
    html: node.outerHTML.slice(0, 200),
  };
}"""


class Keys:
    """Somebody who has only a keyboard."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.faults: list[str] = []

    def press(self, *keys: str) -> None:
        for key in keys:
            self.page.keyboard.press(key)

    def stop(self) -> str:
        """Return the role and the name of what has the focus, such as `button "Play"`, and look at it."""
        stop = self.page.evaluate(STOP)
        if stop["lost"] or stop["main"]:
            return ""
        focused = self.page.locator(":focus")
        line = focused.aria_snapshot().split("\n")[0].removeprefix("- ")
        if not re.match(r'[\w-]+ "[^"]|text: .', line):  # The title of details is a text.
            self.faults.append(f"no name: {line}: {stop['html']}")
        if not stop["ring"]:
            self.faults.append(f"no ring: {line}: {stop['html']}")
        return line

    def to(self, what: str, *, key: str = "Tab") -> None:
        """Press a key until something has the focus."""
        seen = []
        for _ in range(MOST_STOPS):
            self.press(key)
            seen.append(self.stop())
            if seen[-1].startswith(what):
                return
        raise AssertionError(f"expected {what} among the stops, got {seen}")

    def keeps_focus(self) -> None:
        """Wait until something of the page has the focus."""
        until(lambda: not self.page.evaluate(STOP)["lost"])


def _answer_after_the_event(route: Route) -> None:
    """Hold back the answer to an action until the stream has told of it: no button of the job is enabled meanwhile."""
    answer = route.fetch()
    buttons = route.request.frame.page.locator(".actions")
    expect(buttons.get_by_role("button", name="Pause")).to_be_disabled()
    route.request.frame.page.wait_for_timeout(300)  # The focus has time to go somewhere else.
    route.fulfill(response=answer)


def test_everything_is_done_by_keys_alone(page: Page, farm: Farm) -> None:
    made = farm.submit(title="Made", frames="1-2", outputs=[])
    until(lambda: farm.service.status(made) == "done")
    farm.studio.hold()
    running = [farm.submit(title=title, frames="1-3", outputs=[]) for title in ("One", "Two")]
    until(lambda: all(farm.service.status(job) in ("probing", "running") for job in running))
    keys = Keys(page)
    page.emulate_media(reduced_motion="reduce")
    page.goto(farm.url)
    assert keys.stop().startswith('textbox "API key"')
    page.keyboard.type(farm.key)
    keys.press("Enter")
    expect(page.get_by_role("heading", name="Two")).to_be_visible()

    keys.to('link "Skip to')
    keys.to('link "Made')
    keys.press("Enter")
    expect(page.get_by_role("heading", name="Made")).to_be_visible()
    assert keys.stop().startswith('link "Made')
    keys.to('radio "Look"')
    keys.press("ArrowRight")
    expect(page.get_by_role("img", name="focused")).to_have_attribute("aria-busy", "false")
    assert keys.stop().startswith('radio "Focus"')
    keys.press("ArrowLeft")
    keys.to('application "Frame 2')
    keys.press("ArrowRight")
    page.wait_for_url("**x=*")
    keys.press("Space")
    page.wait_for_url("**frame=1*")
    keys.press("Space")
    keys.to('button "Play"')
    keys.press("Enter")
    until(lambda: keys.stop().startswith('button "Pause"'))
    keys.press("Enter")
    until(lambda: keys.stop().startswith('button "Play"'))
    keys.to('listbox "All frames"')
    keys.press("ArrowLeft")
    keys.press("ArrowRight")
    page.wait_for_url("**frame=2*")
    keys.press("ArrowLeft")
    page.wait_for_url("**frame=1*")
    keys.to('button "Next frame"', key="Shift+Tab")
    keys.press("Enter")
    page.wait_for_url("**frame=2*")
    assert keys.stop().startswith('button "Next frame"')  # It has the focus, though there is no other frame.

    keys.to('link "New job"')  # Through all the rest of the page: there is no trap.
    keys.press("Enter")
    expect(page.get_by_label("Title")).to_be_visible()
    keys.to('radio "Fish')
    keys.press("ArrowRight")
    keys.press("ArrowLeft")
    keys.to('button "Submit"')
    keys.press("Enter")
    page.wait_for_url("**/jobs/**")
    keys.keeps_focus()

    for title in ("One", "Two"):
        keys.to(f'checkbox "Select {title}')
        keys.press("Space")
    group = page.get_by_role("group", name="Selected jobs")
    keys.to('button "Pause', key="Shift+Tab")
    keys.press("Enter")
    expect(group.get_by_role("status")).to_have_text("2 of 2 jobs done.")
    until(lambda: all(farm.service.status(job) == "paused" for job in running))
    keys.keeps_focus()
    keys.to('link "Two')
    keys.press("Enter")
    expect(page.get_by_role("heading", name="Two")).to_be_visible()
    keys.to('button "Resume"')
    page.route("**/resume", _answer_after_the_event)
    keys.press("Enter")
    until(lambda: keys.stop().startswith('button "Pause"'))
    keys.to('button "Cancel"')
    keys.press("Enter")
    until(lambda: keys.stop().startswith('button "Keep the job"'))
    keys.press("Enter")
    until(lambda: keys.stop().startswith('button "Cancel"'))
    assert farm.service.status(running[1]) != "cancelled"
    assert "\n".join(sorted(set(keys.faults))) == ""
