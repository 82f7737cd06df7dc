"""The service with many clients of the event stream, against the same service without them."""

from __future__ import annotations

import http.client
import json
import os
import sqlite3
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.client import Client
from lippmann.job.messages.events import Event
from lippmann.job.messages.orders import Order
from lippmann.job.spec import parse_spec
from tests.benchmarks.command import cpu_s, pss_mb
from tests.broker import Broker
from tests.builders_messages import seals_in
from tests.farm import LIPPMANN, admin_key
from tests.integration.service.conftest import FakeWorker, at_once
from tests.waiting import ENOUGH_S, until

CLIENTS = 500
TASKS_PER_S = 20.0
"""What a worker that renders nothing reports: twice what the farm of two slots does with short frames."""
JOBS_LISTED = 50
PHASE_S = 15.0
LIST_PAUSE_S = 0.05
WATCH_PAUSE_S = 0.005


@dataclass(frozen=True)
class Phase:
    """What was measured while a job was running."""

    list_s: NDArray[np.float64]
    tasks_per_s: float
    cores: float
    """The CPU seconds of the service in a second."""
    service_mb: float


@dataclass(frozen=True)
class RunningService:
    """A service in a process of its own, whose worker is this process."""

    client: Client
    url: str
    key: str
    pid: int
    database: Path


def with_clients(folder: Path) -> str:
    """Return p95 of the delay of events, p95 of the job list with clients and without, task rate and memory."""
    with running_service(folder) as service:
        job_id = running_job(service.client)
        alone = measure(service, job_id)
        with listening_clients(service, f"/api/v1/jobs/{job_id}/events", folder / "received.npy") as watch:
            crowded = measure(service, job_id)
        delays_s = _delays_s(watch, np.load(folder / "received.npy"))
    lists = [1000 * float(np.percentile(phase.list_s, 95)) for phase in (crowded, alone)]
    return (
        f"delay {np.percentile(delays_s, 95):.2f} s, list {lists[0]:.0f} ms ({lists[0] / lists[1]:.1f} x {lists[1]:.0f}"
        f" ms), tasks {crowded.tasks_per_s / alone.tasks_per_s:.2f} x {alone.tasks_per_s:.1f}/s, "
        f"{crowded.cores:.2f} cores ({alone.cores:.2f} without), "
        f"{crowded.service_mb:.0f} MB ({alone.service_mb:.0f} without)"
    )


@contextmanager
def running_service(folder: Path, answer: Callable[[Order], list[Event]] | None = None) -> Iterator[RunningService]:
    """Run a service and its broker; the worker answers orders at the pace of a farm of two slots."""
    data_dir, key_file = folder / "data", folder / "admin.key"
    with ExitStack() as stack:
        broker = Broker(folder)
        stack.callback(broker.kill)
        env = {**os.environ, "LIPPMANN_REDIS_URL": broker.url, "LIPPMANN_DATA_DIR": str(data_dir)}
        command = [LIPPMANN, "serve", "--json", "--port", "0", "--key-file", str(key_file)]
        process = stack.enter_context(
            subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        )
        stack.callback(process.terminate)
        assert process.stdout is not None
        started = json.loads(process.stdout.readline())
        key = admin_key(key_file)
        worker = FakeWorker(broker, seals_in(data_dir), answer or paced)
        stack.callback(worker.stop)
        client = stack.enter_context(Client(started["url"], key, patience_s=ENOUGH_S))
        until(lambda: client.health().workers == 1)
        yield RunningService(client, started["url"], key, started["pid"], data_dir / "lippmann.db")


def paced(order: Order) -> list[Event]:
    """Answer an order as a farm of two slots does."""
    time.sleep(1 / TASKS_PER_S)
    return at_once(order)


def running_job(client: Client) -> str:
    """Submit a page of jobs that are cancelled, and a job that runs for longer than the measurement."""
    spec = {"scene": "fish", "outputs": [], "render": {"tiles": [1, 1]}}
    for _ in range(JOBS_LISTED - 1):
        client.cancel(client.submit(parse_spec({**spec, "frames": "1-100"})).id)
    job_id = client.submit(parse_spec({**spec, "frames": "1-5000"})).id
    until(lambda: client.job(job_id).tasks.done > 20)
    return job_id


def measure(service: RunningService, job_id: str) -> Phase:
    """Ask for the list of jobs one time after the other, while a job is running."""
    done, begun_s, used_s = service.client.job(job_id).tasks.done, time.monotonic(), cpu_s(service.pid)
    list_s = _list_s(service, until_s=begun_s + PHASE_S)
    tasks = service.client.job(job_id).tasks.done - done
    lasted_s, used_s = time.monotonic() - begun_s, cpu_s(service.pid) - used_s
    return Phase(list_s, tasks / lasted_s, used_s / lasted_s, pss_mb(service.pid))


def _list_s(service: RunningService, *, until_s: float) -> NDArray[np.float64]:
    """Return the seconds of each list of jobs, requested one after the other."""
    connection = http.client.HTTPConnection(service.url.removeprefix("http://"), timeout=ENOUGH_S)
    taken_s = []
    with closing(connection):
        while time.monotonic() < until_s:
            begun_s = time.monotonic()
            connection.request("GET", "/api/v1/jobs", headers={"Authorization": f"Bearer {service.key}"})
            answer = connection.getresponse()
            assert (answer.status, len(json.loads(answer.read())["items"])) == (200, JOBS_LISTED)
            taken_s.append(time.monotonic() - begun_s)
            time.sleep(LIST_PAUSE_S)
    return np.array(taken_s)


class _Watch:
    """Notes when events become visible in the database, in a thread."""

    def __init__(self, database: Path) -> None:
        self.seen: list[tuple[float, int]] = []
        self._database = database
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._stopping.set()
        self._thread.join(ENOUGH_S)

    def _run(self) -> None:
        with closing(sqlite3.connect(f"file:{self._database}?mode=ro", uri=True)) as connection:
            while not self._stopping.wait(WATCH_PAUSE_S):
                (newest,) = connection.execute("SELECT max(id) FROM job_events").fetchone()
                self.seen.append((time.monotonic(), newest))


@contextmanager
def listening_clients(
    service: RunningService, path: str, file: Path, *, prefix: Sequence[str] = ()
) -> Iterator[_Watch]:
    """Open the streams of many clients; they write what they received to `file` at the end."""
    command = [*prefix, sys.executable, "-m", "tests.benchmarks.stream_clients", service.url, service.key, path]
    process = subprocess.Popen(
        [*command, str(CLIENTS), str(file)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline()
        watch = _Watch(service.database)
        try:
            yield watch
        finally:
            watch.stop()
            process.communicate(timeout=ENOUGH_S)


def _delays_s(watch: _Watch, received: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the time from each event's commit to its arrival, of all events and clients."""
    seen_s, newest = np.array(watch.seen).T
    # The events of the last seconds may not have arrived when the clients stopped.
    first, last = newest[0] + 1, newest[np.searchsorted(seen_s, seen_s[-1] - 3.0)]
    events = np.arange(first, last + 1)
    assert len(events) > PHASE_S * TASKS_PER_S / 4, f"expected a running job, got {len(events)} events"
    visible_s = seen_s[np.searchsorted(newest, events)]
    delays = []
    for number in range(CLIENTS):
        _, arrived_s, upto = received[received[:, 0] == number].T
        assert upto[-1] >= last, f"expected event {last:.0f}, got {upto[-1]:.0f}"
        delays.append(arrived_s[np.searchsorted(upto, events)] - visible_s)
    return np.concatenate(delays)
