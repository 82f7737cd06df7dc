"""Tasks that do nothing, through the whole road: coordinator, broker, Celery worker, lease, events."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tests.benchmarks.bare_worker import BARE, COUNTED, QUEUE, bare_app
from tests.benchmarks.coordinator import WITHIN_S, coordinating, done_at
from tests.broker import Broker
from tests.builders_messages import seals_in
from tests.builders_service import Farm
from tests.waiting import ENOUGH_S, until

SLOTS = 2
FRAMES = 1_500
"""3 tasks each."""
BARE_TASKS = 6_000


def rate(folder: Path) -> str:
    """Return the tasks per second of a farm of two slots whose tasks do nothing, and against bare Celery tasks."""
    broker = Broker(folder)
    try:
        bare, farm = _bare_rate(broker, folder), _farm_rate(broker, folder)
    finally:
        broker.kill()
    return f"{farm:.0f}/s, {farm / bare:.2f} ({bare:.0f}/s)"


def _farm_rate(broker: Broker, folder: Path) -> float:
    seals_in(folder)  # the worker starts before the service, and both need the key
    settings = {"LIPPMANN_REDIS_URL": broker.url, "LIPPMANN_DATA_DIR": str(folder), "LIPPMANN_WORKER_NAME": "w1"}
    settings |= {"LIPPMANN_SLOTS": str(SLOTS), "OPENBLAS_NUM_THREADS": "1"}
    farm = Farm(f"sqlite:///{folder}/farm.db", data_dir=folder)
    job_id = farm.planned(frames=f"1-{FRAMES}", outputs=[])
    with _worker("null_worker", settings, folder), coordinating(farm, broker):
        begun_s, begun = done_at(farm.database, job_id, FRAMES // 2)
        ended_s, ended = done_at(farm.database, job_id, 5 * FRAMES // 2)
    return (ended - begun) / (ended_s - begun_s)


def _bare_rate(broker: Broker, folder: Path) -> float:
    celery = bare_app(broker.url)
    with celery.connection_for_write() as connection, celery.amqp.Producer(connection) as producer:
        for _ in range(BARE_TASKS):
            celery.send_task(BARE, queue=QUEUE, producer=producer, ignore_result=True)
    with _worker("bare_worker", {"BENCHMARK_BROKER": broker.url, "BENCHMARK_SLOTS": str(SLOTS)}, folder):
        begun_s, begun = _counted_at(broker, BARE_TASKS // 6)
        ended_s, ended = _counted_at(broker, 5 * BARE_TASKS // 6)
    celery.close()
    return (ended - begun) / (ended_s - begun_s)


def _counted_at(broker: Broker, tasks: int) -> tuple[float, int]:
    client = broker.client
    until(lambda: int(client.get(COUNTED) or 0) >= tasks, within_s=WITHIN_S)
    return time.monotonic(), int(client.get(COUNTED))


@contextmanager
def _worker(module: str, settings: Mapping[str, str], folder: Path) -> Iterator[None]:
    command = [sys.executable, "-m", f"tests.benchmarks.{module}"]
    with (folder / f"{module}.log").open("wb") as log:
        process = subprocess.Popen(command, env={**os.environ, **settings}, stdout=log, stderr=log)
        try:
            yield
        finally:
            process.terminate()
            process.wait(ENOUGH_S)
