"""The commands of docker-compose.yml as plain processes: a broker, a service and two workers that share a folder."""

from __future__ import annotations

import json
import os
import subprocess
import sysconfig
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import pytest

from lippmann.client import Client
from tests.broker import broker_with_users, free_port
from tests.farm import LIPPMANN, ended
from tests.repository import ROOT
from tests.waiting import ENOUGH_S, until

COMPOSE = str(Path(sysconfig.get_path("scripts")) / "docker-compose")
RUN_SECRETS = "/run/secrets/"


def composed() -> dict[str, Any]:
    ran = subprocess.run(
        [COMPOSE, "--file", ROOT / "docker-compose.yml", "config", "--format", "json"],
        capture_output=True,
        text=True,
        check=True,
    )
    described: dict[str, Any] = json.loads(ran.stdout)
    return described


def secrets_of(service: dict[str, Any], files: dict[str, Any], folder: Path) -> dict[str, str]:
    """Return the files in `folder` that a container sees below /run/secrets."""
    return {
        RUN_SECRETS + secret.get("target", secret["source"]): str(folder / Path(files[secret["source"]]["file"]).name)
        for secret in service["secrets"]
    }


@pytest.fixture
def worker_folders(tmp_path: Path) -> tuple[Path, Path]:
    """The data folders of the workers: each has the artifacts of the farm and nothing else of it."""
    return tmp_path / "worker-1", tmp_path / "worker-2"


@pytest.fixture
def started(tmp_path: Path, worker_folders: tuple[Path, Path]) -> Iterator[Client]:
    """Every command with the environment and the secrets the file gives it; only addresses and folders are others."""
    described, port, secrets = composed(), free_port(), tmp_path / "secrets"
    subprocess.run([ROOT / "deploy/secrets", secrets, str(os.getuid())], check=True)
    for folder in worker_folders:
        folder.mkdir()
        (folder / "artifacts").symlink_to(tmp_path / "data/artifacts")
    with ExitStack() as stack:
        broker_port = stack.enter_context(broker_with_users(secrets / "broker-users.acl", tmp_path))
        here = {"0.0.0.0": "127.0.0.1", "8080": str(port)}
        processes: list[subprocess.Popen[bytes]] = []
        url = f"http://127.0.0.1:{port}"
        for name, data_dir in [("service", tmp_path / "data"), *(("worker", folder) for folder in worker_folders)]:
            service = described["services"][name]
            seen = secrets_of(service, described["secrets"], secrets)
            env = {key: seen.get(value, value) for key, value in service["environment"].items()}
            env["LIPPMANN_REDIS_URL"] = env["LIPPMANN_REDIS_URL"].replace("redis:6379", f"127.0.0.1:{broker_port}")
            env |= {
                "LIPPMANN_DATA_DIR": str(data_dir),
                "LIPPMANN_HEARTBEAT_FILE": str(tmp_path / f"heartbeat-{len(processes)}"),
                "LIPPMANN_KEY_FILE": str(tmp_path / "key"),
                "LIPPMANN_SLOTS": "1",
            }
            words = [here.get(word, word) for word in service["command"]]
            processes.append(subprocess.Popen([LIPPMANN, *words[1:]], env=os.environ | env))
            stack.callback(_end, processes[-1])
            until(lambda: answers(url))  # Workers start once the service is healthy.
        with Client(url, (tmp_path / "key").read_text().strip(), patience_s=ENOUGH_S) as client:
            yield client
        processes[0].terminate()
        assert processes[0].wait(ENOUGH_S) == 0, "the service ends well when it is told to"


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    process.wait(ENOUGH_S)


def answers(url: str) -> bool:
    try:
        return httpx.get(f"{url}/api/v1/health").status_code == 200
    except httpx.TransportError:
        return False


def test_a_service_and_two_workers_do_a_job(started: Client, tmp_path: Path, worker_folders: tuple[Path, Path]) -> None:
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
    # What a worker writes lies in its two volumes; the rest of its file system cannot be written.
    assert all({path.name for path in folder.iterdir()} == {"artifacts", "scratch"} for folder in worker_folders)
