"""Services and workers of an older version are replaced one after the other by this one, in mid-job (`make outages`).

The older version is that of `tests/integration/lippmann/old_farm.py`. It is read from the repository and runs with the
packages of this one.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tarfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select

from lippmann.client import Client
from lippmann.plan import artifact_names as names
from service.db.engine import Database
from service.db.tables import JobEvent
from tests.broker import Broker
from tests.farm import LIPPMANN, ended
from tests.needs import needs_povray
from tests.outages import undisturbed_frame
from tests.postgresql import new_database
from tests.postgresql import postgresql as postgresql
from tests.repository import ROOT
from tests.services import Balancer, EventReader, ServiceProcess, traffic
from tests.waiting import ENOUGH_S, until
from worker.images.read import read_rgb

pytestmark = [needs_povray, pytest.mark.long]

OLD = "5191796"
FRAMES = 8
JOB = {
    "scene": "fish", "frames": f"1-{FRAMES}", "rig": {"lens_array": {"count": [60, 60]}, "px_per_lens": 8},
    "render": {"tiles": [2, 1], "cache": False},
}  # fmt: skip
"""The job of `tests.outages.fish`, without the fields that the older version does not know."""


@pytest.fixture(scope="module")
def old_code(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("old")
    packed = folder / "old.tar"
    ran = subprocess.run(["git", "archive", "-o", str(packed), OLD], cwd=ROOT, check=False)
    if ran.returncode:
        pytest.skip(f"the repository has no commit {OLD}")
    with tarfile.open(packed) as archive:
        archive.extractall(folder, filter="data")
    return folder


class Workers:
    """Processes of workers, each with one slot."""

    def __init__(self, env: dict[str, str], folder: Path) -> None:
        self._env, self._folder = env, folder
        self.running: list[subprocess.Popen[bytes]] = []

    def start(self, name: str, **more: str) -> None:
        with (self._folder / f"{name}.log").open("ab") as log:
            self.running.append(
                subprocess.Popen(
                    [*program(more), "worker", "--slots", "1"],
                    env={**self._env, "LIPPMANN_WORKER_NAME": name, **more}, stdout=log, stderr=subprocess.STDOUT,
                )
            )  # fmt: skip

    def end_first(self) -> None:
        worker = self.running.pop(0)
        worker.terminate()
        worker.wait(ENOUGH_S)

    def end_all(self) -> None:
        while self.running:
            self.end_first()


def program(env: dict[str, str]) -> Sequence[str]:
    """Return the command of this version, or of the one to which `PYTHONPATH` leads."""
    return [sys.executable, "-P", "-m", "lippmann.cli.main"] if "PYTHONPATH" in env else [LIPPMANN]


def begun_at(url: str, key: str) -> str:
    """Submit a job by one process, and return its id when its work has begun, whichever process leads."""
    with Client(url, key) as client:
        job_id = client.submit(JOB | {"frames": "1"}).id
        until(lambda: client.job(job_id).status != "queued")
    return job_id


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def test_a_job_goes_on_while_services_and_workers_are_upgraded_one_after_the_other(
    tmp_path: Path, stack: ExitStack, old_code: Path, postgresql: str
) -> None:
    broker = Broker(tmp_path)
    stack.callback(broker.kill)
    database = stack.enter_context(new_database(postgresql))
    env = {
        **os.environ, "LIPPMANN_REDIS_URL": broker.url, "LIPPMANN_DATA_DIR": str(tmp_path / "data"),
        "LIPPMANN_DATABASE_URL": database, "LIPPMANN_KEEPALIVE_S": "0.5",
    }  # fmt: skip
    old = {"PYTHONPATH": str(old_code)}
    services = [ServiceProcess(name, {**env, **old}, tmp_path) for name in ("service0", "service1")]
    for service in services:
        stack.callback(service.end, signal.SIGKILL)
        service.start(program(old))
    workers = Workers(env, tmp_path)
    stack.callback(workers.end_all)
    for number in range(2):
        workers.start(f"old{number}", **old)
    urls, key = [service.url for service in services], (tmp_path / "admin.key").read_text().strip()
    balancer, reader = Balancer(urls, key), EventReader(urls, key)
    stack.callback(balancer.close)
    job_id = balancer.request("POST", "/jobs", json=JOB).json()["id"]
    until(lambda: balancer.get(f"/jobs/{job_id}")["frames_done"] >= 1)
    with traffic(balancer, [f"/jobs/{job_id}", "/jobs", f"/jobs/{job_id}/tasks"]) as sent:
        for service in services:
            service.end()
            service.env = env
            service.start()
            if service is services[0]:  # the other one, which leads now, is older than the process that stores this job
                later_id = begun_at(service.url, key)
        for number in range(2):
            workers.start(f"new{number}")
            workers.end_first()
        assert balancer.get(f"/jobs/{job_id}")["status"] == "running"
        until(lambda: balancer.get(f"/jobs/{job_id}")["status"] not in ("running", "probing"), within_s=1200)
        until(lambda: balancer.get(f"/jobs/{later_id}")["status"] not in ("running", "probing"), within_s=600)
    print(f"{sent.requests} requests, the longest took {sent.longest_s:.1f} s")
    with Client(urls[0], key) as client:
        job = ended(client, job_id)
        assert (job.status, job.frames_done) == ("done", FRAMES), job.error
        later = ended(client, later_id)
        assert (later.status, later.frames_done) == ("done", 1), later.error
        assert all(task.status == "done" for task in client.tasks(job_id))
        assert {task.worker for task in client.tasks(job_id)} & {"new0", "new1"}
        client.download(job_id, names.orthoscopic_name(1), tmp_path / "first.exr")
    stored = Database(database)
    with stored.reading() as session:
        events = list(session.scalars(select(JobEvent.id).order_by(JobEvent.id)))
    until(lambda: reader.ids == events)
    reader.stop()
    stored.dispose()
    undisturbed = undisturbed_frame(tmp_path / "undisturbed")
    assert np.array_equal(read_rgb(tmp_path / "first.exr", np.float16), undisturbed)
