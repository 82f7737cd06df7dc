"""A test that starts one of everything and does not end; `test_killed_run` kills the test run that is in it."""

from __future__ import annotations

import os
import signal
from pathlib import Path

from playwright.sync_api import Browser

from lippmann.farm.supervisor.descendants import descendants
from tests.broker import Broker
from tests.browser.conftest import chromium, playwright
from tests.farm import JOB_S, farm_up
from tests.integration.service.conftest import postgresql
from tests.waiting import until

__all__ = ["chromium", "playwright", "postgresql"]

STUCK_FILE = "STUCK_FILE"
"""The variable that names the file which is made once everything runs."""


def names_below(pid: int) -> dict[int, str]:
    """Return the names of the programs of all processes below a process, by process id."""
    names = {}
    for below in descendants(pid):
        try:
            names[below] = Path(f"/proc/{below}/comm").read_text().strip()
        except OSError:  # it ended meanwhile
            continue
    return names


def test_never_ends(tmp_path: Path, postgresql: str, chromium: Browser) -> None:
    chromium.new_page()
    broker = Broker(tmp_path)
    with farm_up(tmp_path / "data") as farm:
        farm.client.submit({"scene": "fish", "rig": {"px_per_lens": 64}, "frames": "1-50"})
        until(lambda: "povray" in names_below(os.getpid()).values(), within_s=JOB_S)
        assert broker.client.ping()
        Path(os.environ[STUCK_FILE]).touch()
        while True:
            signal.pause()
