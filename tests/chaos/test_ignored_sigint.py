"""Tests of Ctrl-C pass where a script starts the test run in its background, which ignores SIGINT."""

from __future__ import annotations

import signal
import subprocess
import sys

from tests.repository import ROOT
from tests.waiting import ENOUGH_S

IGNORING = ("sh", "-c", 'trap "" INT; exec "$@"', "sh")


def test_what_a_test_starts_ends_on_sigint() -> None:
    with subprocess.Popen(["sleep", "1000"]) as started:
        try:
            started.send_signal(signal.SIGINT)
            assert started.wait(ENOUGH_S) == -signal.SIGINT
        finally:
            started.kill()


def test_it_does_so_when_the_test_run_ignores_sigint() -> None:
    test = f"{__file__}::{test_what_a_test_starts_ends_on_sigint.__name__}"
    ran = subprocess.run([*IGNORING, sys.executable, "-m", "pytest", test], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stdout
