"""The browser that a farm opens outlives it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

from tests.waiting import ENOUGH_S

FARM = """
import sys
from lippmann.farm.browser_starter import browser_starter
from lippmann.farm.supervisor.descendants import adopt_orphans, kill_all_below
with browser_starter() as open_at:
    adopt_orphans()
    print("waits", flush=True)
    sys.stdin.readline()
    print(open_at("http://127.0.0.1:1/"))
    kill_all_below()
"""
"""A program that treats processes as `lippmann up --open` does: at its end it kills all below itself, with orphans."""
COMMAND = [sys.executable, "-P", "-c", FARM]


def _open(browser: Path) -> str:
    environment = {**os.environ, "BROWSER": str(browser), "PATH": f"{browser.parent}:/usr/bin:/bin", "DISPLAY": ""}
    environment.pop("WAYLAND_DISPLAY", None)  # No browser of the desktop of this machine opens.
    ran = subprocess.run(
        COMMAND, env=environment, input="", stdout=subprocess.PIPE, text=True, timeout=ENOUGH_S, check=True
    )
    return ran.stdout.split()[-1]


def test_a_browser_that_the_farm_opened_goes_on_after_its_end(tmp_path: Path) -> None:
    told, browser = tmp_path / "told", tmp_path / "browser"
    # As programs of desktops do: the command ends at once, and what it started goes on in a session of its own.
    browser.write_text(f'#!/bin/sh\nsetsid sleep 600 &\necho "$! $1" > {told}\n')
    browser.chmod(0o755)
    assert _open(browser) == "True"
    pid, address = told.read_text().split()
    assert address == "http://127.0.0.1:1/"
    running = os.pidfd_open(int(pid))  # It fails if the browser was killed and reaped.
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        assert state not in "ZX"
    finally:
        signal.pidfd_send_signal(running, signal.SIGKILL)
        os.close(running)


def test_a_farm_is_told_that_there_is_no_browser(tmp_path: Path) -> None:
    browser = tmp_path / "browser"
    browser.write_text("#!/bin/sh\nexit 1\n")
    browser.chmod(0o755)
    for name in ("xdg-open", "www-browser", "links", "elinks", "lynx", "w3m"):  # those of this machine do not count
        (tmp_path / name).symlink_to(browser)
    assert _open(browser) == "False"


def test_what_waits_for_the_farm_ends_with_it_also_after_kill_9() -> None:
    with subprocess.Popen(COMMAND, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as farm:
        assert farm.stdout is not None
        assert farm.stdout.readline() == "waits\n"
        farm.kill()
        assert farm.communicate(timeout=ENOUGH_S)[0] == "", "its output closes once nobody has it"
