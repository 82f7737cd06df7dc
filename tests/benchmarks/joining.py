"""The time in which a worker starts to render after it joins a farm that has waiting work."""

from __future__ import annotations

import os
import statistics
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path

from lippmann.client import Client
from lippmann.farm.demo import demo_job
from tests.benchmarks.farm import ROUNDS
from tests.broker import Broker
from tests.farm import LIPPMANN
from tests.services import ServiceProcess
from tests.waiting import ENOUGH_S

POLL_S = 0.02


def start_s(folder: Path) -> str:
    """Return the seconds from the start of a worker's process to its first task, and those since it is online.

    The first task is the probe of a job, which renders; the middle of some workers that start one after another.
    """
    broker = Broker(folder)
    env = {
        **os.environ,
        "LIPPMANN_REDIS_URL": broker.url,
        "LIPPMANN_ORDER_KEY_FILE": str(folder / "order.key"),
        "LIPPMANN_DATA_DIR": str(folder / "data"),
    }
    rounds = []
    with ExitStack() as stack:
        stack.callback(broker.kill)
        service = ServiceProcess("service", env, folder)
        stack.callback(service.end)
        service.start()
        client = stack.enter_context(Client(service.url, service.key_file.read_text().strip(), patience_s=ENOUGH_S))
        for number in range(ROUNDS):
            rounds.append(_joined_s(client, f"worker{number}", env, folder))
    all_s, online_s = (statistics.median(times) for times in zip(*rounds, strict=True))
    return f"{all_s:.1f} s from the start of its process, {online_s:.1f} s since it is online"


def _joined_s(client: Client, name: str, env: dict[str, str], folder: Path) -> tuple[float, float]:
    """Start a worker for a job that waits, end both; return both times."""
    job_id = client.submit(demo_job("1-2") | {"render": {"cache": False}}).id
    own = {"LIPPMANN_WORKER_NAME": name}
    started_s = time.monotonic()
    online_s = None
    with (folder / f"{name}.log").open("ab") as log:
        worker = subprocess.Popen(
            [LIPPMANN, "worker", "--slots", "1"], env=env | own, stdout=log, stderr=subprocess.STDOUT
        )
    try:
        while client.job(job_id).status == "queued" or not any(
            task.status == "running" for task in client.tasks(job_id)
        ):
            if online_s is None and client.health().slots:
                online_s = time.monotonic()
            assert time.monotonic() - started_s < ENOUGH_S
            time.sleep(POLL_S)
        now_s = time.monotonic()
        return now_s - started_s, now_s - (online_s or now_s)
    finally:
        client.cancel(job_id)
        worker.terminate()
        worker.wait(ENOUGH_S)
