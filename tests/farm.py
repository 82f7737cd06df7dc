"""A whole farm for tests: `lippmann up` as a user starts it, on a free port and a folder of its own."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sysconfig
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from lippmann.client import Client
from lippmann.client.address import read_farm_file
from lippmann.farm.supervisor.descendants import descendants
from service.schemas.job import Job
from tests.waiting import ENOUGH_S
from tests.waiting import until as until_yes

LIPPMANN = str(Path(sysconfig.get_path("scripts")) / "lippmann")

ENDED = ("done", "failed", "cancelled")
JOB_S = 400.0
"""A limit for jobs that take seconds when nothing else runs."""


@dataclass(frozen=True)
class Farm:
    """A farm that is up."""

    process: subprocess.Popen[str]
    data_dir: Path
    client: Client

    def kill(self) -> None:
        """End the supervisor as the kernel would when memory runs out: without a word."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()


@contextmanager
def farm_up(data_dir: Path, *, slots: int = 2, env: Mapping[str, str] | None = None) -> Iterator[Farm]:
    """Lend a farm; ends it as Ctrl-C does, unless it was killed."""
    process = subprocess.Popen(
        [LIPPMANN, "up", "--json", "--port", "0", "--slots", str(slots), "--data-dir", str(data_dir)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **(env or {})},
    )
    try:
        assert process.stdout is not None
        json.loads(process.stdout.readline())
        address = read_farm_file(data_dir)
        assert address is not None
        with Client(address.url, address.key, patience_s=ENOUGH_S) as client:
            yield Farm(process, data_dir, client)
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
            process.wait(ENOUGH_S)
        if process.stdout:
            process.stdout.close()


def ended(client: Client, job_id: str, *, within_s: float = JOB_S) -> Job:
    """Return a job once it has ended."""
    return until(client, job_id, lambda job: job.status in ENDED, within_s=within_s)


def until(client: Client, job_id: str, right: object, *, within_s: float = JOB_S) -> Job:
    """Return a job once it is as asked for, polling as an impatient user does."""
    assert callable(right)
    stop = time.monotonic() + within_s
    while True:
        job = client.job(job_id)
        if right(job):
            return job
        assert time.monotonic() < stop, f"expected the job to get there within {within_s} s, got {job}"
        time.sleep(0.1)


def busy_children(worker_pid: int) -> list[int]:
    """Return the pool processes of a worker that have a POV-Ray below them."""
    return [pid for pid in descendants(worker_pid) if _parent(pid) == worker_pid and descendants(pid)]


def _parent(pid: int) -> int:
    try:
        return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return 0


def wait_for_slots(client: Client, slots: int) -> None:
    """Wait until the workers of the farm have this many slots together."""
    until_yes(lambda: client.health().slots == slots, every_s=0.1)


def admin_key(key_file: Path) -> str:
    """Return the key of the first admin once the service has written its file."""
    return str(until_yes(lambda: key_file.exists() and key_file.read_text().strip()))
