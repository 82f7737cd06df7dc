"""The first steps of a new user, as the pages give them: README.md, docs/getting-started.md, docs/http-api.md.

One farm serves all of them: the one that the page itself starts, in a new shell, in a clone of the repository.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray
from playwright.sync_api import Browser, expect
from pypdf import PdfReader

from lippmann.client.address import read_farm_file
from tests.needs import need_to_run, needs_povray
from tests.page_steps import steps_of
from tests.pictures import read_png
from tests.repository import DOCS, ROOT
from tests.waiting import ENOUGH_S, until

pytestmark = needs_povray

BEGINNING, API = (steps_of((DOCS / page).read_text(encoding="utf-8")) for page in ("getting-started.md", "http-api.md"))
INSTALL, UP, *WORK = BEGINNING.commands
NEWEST_JOB = """$(lippmann jobs --json | python3 -c 'import json, sys; print(json.load(sys.stdin)[0]["id"])')"""
"""What a person reads in the list of jobs."""
NO_INSTALLATION = 'make() { command make --old-file .venv/.installed "$@"; }\n'
"""The tests run in the environment that `make setup` has made, which is not made again."""


@dataclass
class Clone:
    """A clone of the repository, with the environment of the tests, and a farm that runs in it."""

    folder: Path
    environment: dict[str, str]

    @property
    def printed(self) -> list[str]:
        """The lines that the first terminal has shown."""
        return (self.folder / "terminal.txt").read_text(encoding="utf-8").splitlines()

    @property
    def opened(self) -> Path:
        """The file with the link that the browser was asked to open."""
        return self.folder / "opened.txt"

    def start(self, lines: str) -> subprocess.Popen[bytes]:
        with (self.folder / "terminal.txt").open("wb") as terminal:
            return subprocess.Popen(
                ["bash", "-c", lines], cwd=self.folder, env=self.environment, stdout=terminal,
                stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip

    def type(self, *blocks: str) -> None:
        """Type lines in a new terminal, and see that each of them succeeds."""
        lines = "set -e\nsource .venv/bin/activate\nset -x\n" + "".join(blocks)
        ran = subprocess.run(
            ["bash", "-c", lines],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=ENOUGH_S,
        )
        assert ran.returncode == 0, ran.stderr[-3000:]


@pytest.fixture(scope="module")
def clone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Clone]:
    """A clone in which the first terminal of the page has started a farm."""
    folder = tmp_path_factory.mktemp("home") / "lippmann"
    folder.mkdir()
    for entry in ROOT.iterdir():
        if entry.name not in {".git", ".venv", "data", "out"}:
            (folder / entry.name).symlink_to(entry)
    (folder / ".venv").symlink_to(sys.prefix)
    browser = folder / "browser"
    browser.write_text(f'#!/bin/sh\necho "$1" > {folder}/opened.txt\n')
    browser.chmod(0o755)
    # A new shell finds only what the system has; the port and the browser are those of the test.
    environment = {
        "HOME": str(folder.parent), "LANG": "C.UTF-8", "PATH": "/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
        "LIPPMANN_PORT": "0", "BROWSER": str(browser),
    }  # fmt: skip
    clone = Clone(folder, environment)
    terminal = clone.start("set -e\n" + NO_INSTALLATION + INSTALL + UP)
    try:
        until(lambda: clone.opened.exists() or terminal.poll() is not None)
        assert terminal.poll() is None, clone.printed
        yield clone
    finally:
        os.killpg(terminal.pid, signal.SIGINT)
        terminal.wait(ENOUGH_S)


@pytest.fixture(scope="module")
def worked(clone: Clone) -> Clone:
    """The clone after everything that the page types in the second terminal."""
    BEGINNING.write_files(clone.folder)
    clone.type(*(block.replace("fetch JOB", f"fetch {NEWEST_JOB}") for block in WORK))
    return clone


def test_setup_says_how_to_call_the_command_and_the_link_is_the_last_line(clone: Clone) -> None:
    assert any(line.startswith("Lippmann is installed. The command is .venv/bin/lippmann.") for line in clone.printed)
    link = clone.printed[-1].strip()
    assert re.match(
        r"Open this link in a browser. It works once, until \d{4}-\d\d-\d\dT[\d:]{8}[+-]", clone.printed[-3]
    )
    opened = clone.opened.read_text().strip()
    assert link != opened, "the browser has a link of its own, so that the printed one still works"
    assert (httpx.get(link).status_code, httpx.get(link).status_code) == (303, 401)
    used = httpx.get(link, headers={"Accept": "text/html"})
    assert (used.status_code, "this login link was used" in used.text) == (401, True)


def test_the_readme_begins_with_the_steps_of_the_page() -> None:
    first = steps_of((ROOT / "README.md").read_text(encoding="utf-8")).commands[0]
    lines = [line.partition("#")[0].strip() for line in first.splitlines()]
    _, activate = INSTALL.splitlines()  # before it stands `make demo`, which runs `make setup`
    assert lines == [activate, UP.strip()]


def test_the_page_ends_with_pictures_a_video_a_scene_of_ones_own_and_a_print(worked: Clone) -> None:
    out = worked.folder / "out"
    for name in ("fish/orthoscopic/0001.png", "fish/views/0001.png", "fish/video/views.mp4"):
        assert (out / name).stat().st_size > 1000
    views = read_png(out / "balls" / "views" / "0001.png")
    assert reds(views) > 0.02, "the red ball is in the views"
    assert reds(read_png(out / "balls" / "left.png")) > 0.02
    (page,) = PdfReader(out / "balls" / "exports" / "print" / "0001.pdf").pages
    assert float(page.mediabox.width) / 72 * 25.4 == pytest.approx(90 + 2 * 12, abs=1), "90 lenses of 1 mm, and margins"


def reds(codes: NDArray[np.uint8]) -> float:
    """Return the share of pixels that are the red of the ball."""
    red, green, blue = (codes[..., channel].astype(int) for channel in range(3))
    return float(((red > 90) & (red > green + 40) & (green > blue - 20)).mean())


def test_the_pointer_turns_the_fish(worked: Clone, chromium: Browser) -> None:
    address = read_farm_file(worked.folder / "data")
    assert address is not None
    # Without motion the picture follows the pointer at once, and without a graphics card every pixel costs.
    page = chromium.new_context(viewport={"width": 900, "height": 600}, reduced_motion="reduce").new_page()
    page.goto(worked.opened.read_text().strip())
    stage = page.locator(".stage")
    expect(stage.locator("canvas[aria-busy=false]")).to_be_visible()
    box = stage.bounding_box()
    assert box
    canvas, shown = stage.locator("canvas"), set[str]()
    for part in (0.15, 0.85):
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] * part, box["y"] + box["height"] / 2, steps=3)
        page.mouse.up()
        before = set(shown)
        until(lambda before=before: canvas.evaluate(PIXELS) not in before)
        shown.add(canvas.evaluate(PIXELS))
    page.context.close()
    assert len(shown) == 2, "left and right show two views"


PIXELS = """canvas => {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [64, 64];
  copy.getContext("2d").drawImage(canvas, 0, 0, 64, 64);
  return copy.toDataURL();
}"""


def test_a_first_visit_leads_from_the_link_to_the_eye_of_a_fish_by_what_the_page_shows(
    clone: Clone, chromium: Browser
) -> None:
    clone.type("lippmann keys link > link.txt\n")
    (link,) = re.findall(r"http\S+token=\S+", (clone.folder / "link.txt").read_text())
    page = chromium.new_context(viewport={"width": 1366, "height": 768}, reduced_motion="reduce").new_page()
    page.goto(link)
    page.get_by_role("link", name="New job").click()
    submit = page.get_by_role("button", name="Submit")
    expect(submit).to_be_in_viewport(ratio=1)  # before anything is scrolled
    for field, value in {"Rows": "24", "Columns": "24", "Frames": "1"}.items():  # a small one, for the sake of time
        page.get_by_label(field, exact=True).fill(value)
    submit.click()
    picture = page.locator(".stage canvas[aria-busy=false]:not(.empty)")
    expect(picture).to_be_visible()
    expect(page.get_by_text("Drag, or press the arrow keys, to turn the scene.")).to_be_in_viewport()
    box = picture.bounding_box()
    assert box
    middle = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    shown = set[str]()
    for away in (-0.4, 0.4):
        page.mouse.move(middle[0] + away * box["width"], middle[1])
        until(lambda: picture.evaluate(PIXELS) not in shown)
        shown.add(picture.evaluate(PIXELS))
    page.get_by_role("radio", name="Focus").check()
    expect(page.get_by_text("Click an object to focus on it")).to_be_in_viewport()
    expect(picture).to_be_visible()
    page.mouse.click(*middle)
    expect(page.locator(".stage .found")).to_contain_text(re.compile(r"mm (in front of|behind) the display"))
    page.context.close()


def test_ten_calls_of_curl_do_what_a_user_does(worked: Clone) -> None:
    need_to_run(["curl", "--version"], what="curl is not installed")
    address = read_farm_file(worked.folder / "data")
    assert address is not None
    blocks = [block.replace("http://127.0.0.1:8080", address.url) for block in API.commands]
    calls = [line for block in blocks for line in block.splitlines() if line.strip().startswith("curl ")]
    assert len(calls) == 10
    API.write_files(worked.folder)
    worked.type(*blocks)
    headers = {"Authorization": f"Bearer {address.key}"}
    job = (worked.folder / "job.json").read_text(encoding="utf-8")
    job_id = re.findall(r'"id": ?"(\w+)"', job)[0]
    assert '"done"' in job
    assert httpx.get(f"{address.url}/api/v1/jobs/{job_id}", headers=headers).status_code == 404, "it was removed"
    assert read_png(worked.folder / "left.png").shape[:2] == (24, 24)
    assert (worked.folder / "views.mp4").read_bytes()[4:8] == b"ftyp"
    assert "orthoscopic/0001.exr" in (worked.folder / "files.json").read_text()
    assert (worked.folder / "farm.curl").stat().st_mode & 0o777 == 0o600
