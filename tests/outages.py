"""Farms whose broker a test takes away: `lippmann serve` and `lippmann worker` with a proxy, and `lippmann up`."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from redis import Redis

from lippmann.client import Client
from lippmann.farm.supervisor.broker import socket_path
from lippmann.job.messages import wire
from lippmann.job.messages.events import Presence
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from service.schemas.job import Job
from tests.broker import Broker
from tests.builders import small_job
from tests.farm import LIPPMANN, admin_key, farm_up, wait_for_slots
from tests.tcp_proxy import TcpProxy, tcp_proxy
from tests.waiting import ENOUGH_S, until
from tests.without_farm import masters_without_farm
from worker.images.read import read_rgb

QUICK = {"LIPPMANN_LEASE_TTL_S": "8", "LIPPMANN_UNCLAIMED_S": "6", "LIPPMANN_RECONCILE_S": "1"}
"""A lost attempt is noticed in 8 s instead of 45, so that the test is short; heartbeats stay at 5 s."""


@dataclass(frozen=True)
class OutageFarm:
    """A farm with one worker, whose broker can be taken away."""

    client: Client
    data_dir: Path
    proxy: TcpProxy
    """Every connection of the service and the worker to the broker goes through it."""
    redis: Any
    """A client of the broker that does not go through the proxy."""
    worker_log: Path
    worker_pid: Callable[[], int]
    broker: Broker | None = None
    """The broker, if the test may end it."""

    def presence(self) -> Presence | None:
        """Return the presence of the worker as it is in the broker."""
        (*keys,) = self.redis.scan_iter(match=wire.presence_key("*"))
        text = self.redis.get(keys[0]) if keys else None
        return Presence.model_validate_json(text) if text else None

    def seconds_until_an_order_is_taken(self, *, within_s: float = ENOUGH_S) -> float:
        """Return the time until the worker takes its next order."""
        begun_s, clock_s = time.monotonic(), time.time()
        until(lambda: (seen := self.presence()) and (seen.order_s or 0.0) > clock_s, within_s=within_s)
        return time.monotonic() - begun_s


@contextmanager
def separate_farm(folder: Path, *, slots: int = 2, env: Mapping[str, str] | None = None) -> Iterator[OutageFarm]:
    """Lend a farm of a broker, a service and a worker that were started one by one."""
    data_dir, key_file, log = folder / "data", folder / "admin.key", folder / "worker.log"
    broker = Broker(folder)
    with ExitStack() as stack:
        stack.callback(broker.kill)
        proxy = stack.enter_context(tcp_proxy(("127.0.0.1", broker.port)))
        assert isinstance(proxy.address, tuple)
        url = f"redis://127.0.0.1:{proxy.address[1]}/0"
        told = {**os.environ, **(env or {}), "LIPPMANN_REDIS_URL": url, "LIPPMANN_DATA_DIR": str(data_dir)}
        serve = [LIPPMANN, "serve", "--json", "--port", "0", "--key-file", str(key_file)]
        service = stack.enter_context(_process(serve, env=told, stdout=subprocess.PIPE, text=True))
        assert service.stdout is not None
        address = json.loads(service.stdout.readline())["url"]
        key = admin_key(key_file)
        output = stack.enter_context(log.open("wb"))
        command = [LIPPMANN, "worker", "--slots", str(slots)]
        worker = stack.enter_context(_process(command, env=told, stdout=output, stderr=subprocess.STDOUT))
        client = stack.enter_context(Client(address, key, patience_s=ENOUGH_S))
        wait_for_slots(client, slots)
        yield OutageFarm(client, data_dir, proxy, broker.client, log, lambda: worker.pid, broker)


@contextmanager
def one_machine_farm(folder: Path, *, slots: int = 2, env: Mapping[str, str] | None = None) -> Iterator[OutageFarm]:
    """Lend a farm of `lippmann up`, with a proxy in the place of the socket of its broker."""
    data_dir = folder / "data"
    with ExitStack() as stack:
        farm = stack.enter_context(farm_up(data_dir, slots=slots, env=env))
        wait_for_slots(farm.client, slots)
        socket = socket_path(data_dir / "broker")
        moved = socket.with_name("moved.sock")
        socket.rename(moved)
        stack.callback(moved.unlink, missing_ok=True)
        proxy = stack.enter_context(tcp_proxy(moved, listen=socket))
        redis: Any = Redis.from_url(f"unix://{moved}", protocol=2, socket_timeout=ENOUGH_S)
        redis.client_kill_filter(_type="normal", skipme=True)
        until(lambda: any(client["cmd"] == "brpop" for client in redis.client_list()))

        def worker_pid() -> int:
            return farm.client.workers().items[0].pid

        yield OutageFarm(farm.client, data_dir, proxy, redis, data_dir / "log" / "worker.log", worker_pid)


@contextmanager
def _process(command: list[str], **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """Run a process; ends it as a service manager does."""
    process = subprocess.Popen(command, **options)
    try:
        yield process
    finally:
        process.send_signal(signal.SIGTERM)
        try:
            process.wait(ENOUGH_S)
        finally:
            process.kill()
            if process.stdout:
                process.stdout.close()


def fish(frames: str, **more: Any) -> JobSpec:
    """Return a job of a few seconds a tile."""
    return small_job("fish", count=(60, 60), frames=frames, tiles=[2, 1], **more)


def undisturbed_frame(folder: Path) -> NDArray[np.float16]:
    """Return frame 1 of `fish`, rendered without a farm."""
    return masters_without_farm(folder, fish("1"))[1]


def first_frame(farm: OutageFarm, job: Job) -> NDArray[np.float16]:
    """Return frame 1 of a job as the farm has it."""
    path = farm.data_dir / "artifacts" / names.job_artifact(job.id, names.orthoscopic_name(1))
    return read_rgb(path, np.float16)


def assert_each_frame_is_there_once(farm: OutageFarm, job: Job, undisturbed: NDArray[np.float16]) -> None:
    """Check that a job is done, with the pixels of an undisturbed run."""
    assert job.status == "done", job.error
    assert job.frames_done == job.frames_total
    tasks = list(farm.client.tasks(job.id))
    assert all(task.status == "done" for task in tasks)
    assert sum(task.kind == "render" for task in tasks) == 2 * job.frames_total
    assert (first_frame(farm, job) == undisturbed).all()


def rendering(job: Job, slots: int = 2) -> bool:
    """Return whether a job renders in all slots."""
    return bool(job.status == "running" and job.tasks.running >= slots and job.progress > 0.02)
