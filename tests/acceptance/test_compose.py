"""The commands of docker-compose.yml as plain processes: a broker, a service and two workers that share a folder."""

from __future__ import annotations

import json
import os
import subprocess
import sysconfig
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from lippmann.client import Client
from tests.broker import Broker, free_port
from tests.farm import LIPPMANN, ended
from tests.repository import ROOT
from tests.waiting import ENOUGH_S, until

COMPOSE = str(Path(sysconfig.get_path("scripts")) / "docker-compose")


def composed() -> dict[str, Any]:
    ran = subprocess.run(
        [COMPOSE, "--file", ROOT / "docker-compose.yml", "config", "--format", "json"],
        capture_output=True,
        text=True,
        check=True,
    )
    services: dict[str, Any] = json.loads(ran.stdout)["services"]
    return services


@pytest.fixture
def started(tmp_path: Path) -> Iterator[Client]:
    """Every command with the environment the file gives it; only addresses and folders are this machine's."""
    services, broker, port = composed(), Broker(tmp_path), free_port()
    here = {"0.0.0.0": "127.0.0.1", "8080": str(port)}
    processes: list[subprocess.Popen[bytes]] = []
    for name in ("service", "worker", "worker"):
        env = services[name]["environment"] | {
            "LIPPMANN_REDIS_URL": broker.url,
            "LIPPMANN_DATA_DIR": str(tmp_path / "data"),
            "LIPPMANN_HEARTBEAT_FILE": str(tmp_path / f"heartbeat-{len(processes)}"),
            "LIPPMANN_KEY_FILE": str(tmp_path / "key"),
            "LIPPMANN_SLOTS": "1",
        }
        words = [here.get(word, word) for word in services[name]["command"]]
        processes.append(subprocess.Popen([LIPPMANN, *words[1:]], env=os.environ | env))
    try:
        url = f"http://127.0.0.1:{port}"
        until(lambda: answers(url))
        with Client(url, (tmp_path / "key").read_text().strip(), patience_s=ENOUGH_S) as client:
            yield client
    finally:
        for process in processes:
            process.terminate()
        codes = [process.wait(ENOUGH_S) for process in processes]
        broker.kill()
    assert codes[0] == 0, "the service ends well when it is told to"


def answers(url: str) -> bool:
    try:
        return httpx.get(f"{url}/api/v1/health").status_code == 200
    except httpx.TransportError:
        return False


def test_a_service_and_two_workers_do_a_job(started: Client, tmp_path: Path) -> None:
    until(lambda: len(started.workers().items) == 2)
    job = started.submit(
        {
            "scene": "target-letter",
            "frames": "1-4",
            "rig": {"lens_array": {"count": [20, 20]}, "px_per_lens": 4},
            "outputs": ["orthoscopic.mkv"],
        }
    )
    assert ended(started, job.id).status == "done"
    workers = {task.worker for task in started.tasks(job.id) if task.kind == "render"}
    assert len(workers) == 2, "both of them rendered"
    assert all((tmp_path / f"heartbeat-{number}").exists() for number in (1, 2))
