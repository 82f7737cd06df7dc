"""The count of refused messages, by processes that were forked after it was made."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable

import pytest
from structlog.testing import capture_logs

from tests.waiting import ENOUGH_S
from worker import refusals as module
from worker.refusals import LOG_S, Refusals


def in_a_child(act: Callable[[], object]) -> int:
    """Do something in a forked process, and return the id of the process."""
    child = os.fork()
    if child == 0:
        try:
            act()
            os._exit(0)
        finally:
            os._exit(1)  # Whatever fails, the child must not go on as pytest.
    return child


def test_processes_count_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "HELD_S", ENOUGH_S)  # A busy machine may hold a process up for a second.
    refusals = Refusals()

    def count() -> None:
        for _ in range(200):
            refusals.record("nonsense")

    for child in [in_a_child(count) for _ in range(3)]:
        assert os.waitpid(child, 0)[1] == 0
    assert refusals.count == 600


def test_a_reason_is_logged_every_few_seconds() -> None:
    now_s = [100.0]
    refusals = Refusals(steady=lambda: now_s[0])
    with capture_logs() as logs:
        for pause_s in (0.0, LOG_S / 2, LOG_S / 2):
            now_s[0] += pause_s
            refusals.record("nonsense")
    assert [entry["refused"] for entry in logs] == [1, 3]


def test_a_process_that_is_killed_while_it_counts_holds_up_no_other() -> None:
    parent = os.getpid()

    def read_clock() -> float:
        if os.getpid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)
        return time.monotonic()

    refusals = Refusals(steady=read_clock)
    child = in_a_child(lambda: refusals.record("nonsense"))
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
    counted = refusals.count
    for _ in range(2):
        refusals.record("nonsense")
    assert refusals.count == counted + 2
