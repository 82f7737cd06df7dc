"""A worker with a running attempt is told to end: the attempt ends first, whatever fails."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from lippmann.errors import Stopped
from lippmann.job.messages.events import EventKind
from lippmann.job.messages.seals import Seals
from tests.broker import Broker
from tests.builders_messages import seals_in
from tests.integration.lippmann.test_refusals import events, order, publish
from tests.repository import ROOT
from tests.waiting import ENOUGH_S, until

WAITING = """
import time
from lippmann.errors import Stopped
from lippmann.farm.worker import worker_arguments
from worker.app import app
from worker.tasks import entry

def wait(_place, _order, monitor):
    while not monitor.should_stop():
        time.sleep(0.05)
    raise Stopped

entry.encode_output = wait
app.worker_main(worker_arguments(name="w1"))
"""
"""A worker whose outputs are never done."""


@contextmanager
def working(broker: Broker, seals: Seals, folder: Path, *before: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a worker that leads its process group, with its log in a folder, and wait until it works at an attempt."""
    env = {
        **os.environ,
        "LIPPMANN_REDIS_URL": broker.url,
        "LIPPMANN_DATA_DIR": str(folder),
        "LIPPMANN_WORKER_NAME": "w1",
        "LIPPMANN_SLOTS": "1",
    }
    command = [*before, sys.executable, "-c", WAITING]
    with (folder / "log").open("wb") as log:
        worker = subprocess.Popen(
            command, env=env, stdout=log, stderr=subprocess.STDOUT, cwd=ROOT, start_new_session=True,
            preexec_fn=partial(signal.signal, signal.SIGHUP, signal.SIG_DFL),  # These tests may run under nohup.
        )  # fmt: skip
    try:
        publish(broker, seals, order("a1"))
        until(lambda: EventKind.CLAIMED in [event.kind for event in events(broker.client, seals)])
        yield worker
    finally:
        worker.kill()
        worker.wait()
        broker.kill()


def end_of_attempt(broker: Broker, seals: Seals) -> str | None:
    """Return the code of the failure with which the attempt ended."""
    (failure,) = [event.failure for event in events(broker.client, seals) if event.kind is EventKind.FAILED]
    return failure.code if failure else None


def test_a_worker_that_cannot_write_its_stopping_file_ends_its_attempts_nevertheless(tmp_path: Path) -> None:
    broker, seals = Broker(tmp_path), seals_in(tmp_path)
    with working(broker, seals, tmp_path) as worker:
        (tmp_path / "scratch/stopping-w1").symlink_to(tmp_path / "gone/stopping")
        worker.send_signal(signal.SIGTERM)
        assert worker.wait(ENOUGH_S) == 0


def test_a_worker_whose_terminal_closes_ends_its_attempts_in_order(tmp_path: Path) -> None:
    broker, seals = Broker(tmp_path), seals_in(tmp_path)
    with working(broker, seals, tmp_path) as worker:
        os.killpg(worker.pid, signal.SIGHUP)
        assert worker.wait(ENOUGH_S) == 0
        assert end_of_attempt(broker, seals) == Stopped.code
        assert "Restarting" not in (tmp_path / "log").read_text()


def test_a_worker_under_nohup_goes_on_when_its_terminal_closes(tmp_path: Path) -> None:
    broker, seals = Broker(tmp_path), seals_in(tmp_path)
    with working(broker, seals, tmp_path, "nohup") as worker:
        os.killpg(worker.pid, signal.SIGHUP)
        (ignored,) = re.findall(r"SigIgn:\s*(\w+)", Path(f"/proc/{worker.pid}/status").read_text())
        assert int(ignored, 16) & 1 << (signal.SIGHUP - 1)
        worker.send_signal(signal.SIGTERM)
        assert worker.wait(ENOUGH_S) == 0
        assert end_of_attempt(broker, seals) == Stopped.code
