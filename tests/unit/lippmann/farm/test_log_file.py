"""A log whose reader has gone ends no work."""

from __future__ import annotations

import subprocess
import sys

from tests.waiting import ENOUGH_S

WORK = """
import logging, os, sys, time
import structlog
from lippmann.farm.serve import _log_to_stderr
from service.settings import Settings
_log_to_stderr(Settings())
sys.stdin.readline()
for _ in range(3):
    structlog.get_logger().warning("a round failed")
    logging.getLogger("x").warning("a round failed")
print("still here", flush=True)
"""


def test_a_process_whose_log_nobody_reads_any_more_works_on() -> None:
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", WORK], stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stderr.close()
        process.stdin.write("go\n")
        process.stdin.close()
        assert process.stdout.read() == "still here\n"
        process.wait(ENOUGH_S)
