"""Pages of jobs, tasks and frames on a large farm: 10,000 jobs with 1,000,000 tasks."""

from __future__ import annotations

import http.client
import json
import os
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy import text

from service.db.tables import Job, Task
from service.jobs.commands import pause_job, resume_job
from service.schemas.job import JobSort
from tests.benchmarks.command import cpu_s
from tests.broker import Broker
from tests.builders_service import Farm
from tests.farm import LIPPMANN, admin_key

JOBS = 10_000
FRAMES = "1-33"
"""The frames of a job: with 2 tiles each and their assembly 99 tasks, and a probe and a video."""
LARGE_FRAMES = "1-4000"
WAITING_SHARE = 100
"""One of so many jobs waits; all others are done."""
COPIED_AT_ONCE = 1000
ROUNDS = 40


@dataclass(frozen=True)
class Answered:
    """A service on a large farm, and what its pages are."""

    url: str
    key: str
    pid: int
    paths: dict[str, str]


def slowest_page(folder: Path) -> str:
    """Return p95 of the slowest page, which page it is, and its CPU time, which other load does not change."""
    large = _large_farm(folder)
    with _service(folder, large) as service, closing(_connection(service)) as connection:
        slowest = max((_measured(service, connection, name) for name in service.paths), key=lambda one: one[0])
    p95_s, page_s, name = slowest
    return f"{1000 * p95_s:.0f} ms ({name}; {1000 * page_s:.0f} ms CPU)"


def _measured(service: Answered, connection: http.client.HTTPConnection, name: str) -> tuple[float, float, str]:
    """Return p95 of the wall time of a page, and the CPU time of one."""
    _get(service, connection, name)
    taken_s, used_s = [], cpu_s(service.pid)
    for _ in range(ROUNDS):
        begun_s = time.monotonic()
        _get(service, connection, name)
        taken_s.append(time.monotonic() - begun_s)
    return float(np.percentile(taken_s, 95)), (cpu_s(service.pid) - used_s) / ROUNDS, name


def _get(service: Answered, connection: http.client.HTTPConnection, name: str) -> Any:
    connection.request("GET", f"/api/v1{service.paths[name]}", headers={"Authorization": f"Bearer {service.key}"})
    answer = connection.getresponse()
    body = json.loads(answer.read())
    assert answer.status == 200, body
    assert body.get("items", True), f"expected items in {name}"
    return body


def _connection(service: Answered) -> http.client.HTTPConnection:
    return http.client.HTTPConnection(service.url.removeprefix("http://"))


@contextmanager
def _service(folder: Path, large: str) -> Iterator[Answered]:
    """Start a service that only answers; yield it and its pages."""
    key_file, broker = folder / "admin.key", Broker(folder)
    env = {
        **os.environ,
        "LIPPMANN_REDIS_URL": broker.url,
        "LIPPMANN_DATA_DIR": str(folder),
        "LIPPMANN_COORDINATOR": "false",
    }
    command = [LIPPMANN, "serve", "--json", "--port", "0", "--key-file", str(key_file)]
    quiet = subprocess.DEVNULL
    with subprocess.Popen(command, env=env, stdout=subprocess.PIPE, stderr=quiet, text=True) as process:
        try:
            assert process.stdout is not None
            started = json.loads(process.stdout.readline())
            key = admin_key(key_file)
            paths = {
                "jobs": "/jobs",
                "done jobs": "/jobs?status=done",
                "running jobs": "/jobs?status=running",
                "jobs, half-way": f"/jobs?cursor={_name(JOBS // 2)}",
                **{f"jobs by {sort}": f"/jobs?sort={sort}&offset={JOBS // 2}&count=true" for sort in JobSort},
                "a search": "/jobs?search=copy0999&count=true",
                "a job": f"/jobs/{large}",
                "tasks": f"/jobs/{large}/tasks",
                "waiting tasks": f"/jobs/{large}/tasks?status=waiting",
                "tasks, half-way": f"/jobs/{large}/tasks?cursor=6000",
                "encode tasks": f"/jobs/{large}/tasks?kind=encode",
                "frames": f"/jobs/{large}/frames",
                "frames, half-way": f"/jobs/{large}/frames?cursor=2000",
            }
            yield Answered(started["url"], key, started["pid"], paths)
        finally:
            process.terminate()
            broker.kill()


def _large_farm(folder: Path) -> str:
    """Make the database of a large farm by copying jobs that the farm made; return the id of its largest job."""
    farm = Farm(f"sqlite:///{folder}/lippmann.db", data_dir=folder)
    waiting = farm.planned(frames=FRAMES)
    with farm.writing() as session:
        pause_job(session, waiting, now_s=farm.now_s)  # so that only the others are worked on
    done = farm.planned(frames=FRAMES)
    farm.work()
    large = farm.planned(frames=LARGE_FRAMES)
    with farm.writing() as session:
        resume_job(session, waiting, now_s=farm.now_s, limit=farm.settings.failure_limit)
    numbers = range(JOBS)
    for start in numbers[::COPIED_AT_ONCE]:
        chunk = numbers[start : start + COPIED_AT_ONCE]
        _copy(farm, done, [_name(number) for number in chunk if number % WAITING_SHARE])
        _copy(farm, waiting, [_name(number) for number in chunk if number % WAITING_SHARE == 0])
    farm.database.checkpoint()
    farm.database.dispose()
    return large


def _name(number: int) -> str:
    return f"0copy{number:05}"


def _copy(farm: Farm, job_id: str, names: list[str]) -> None:
    with farm.writing() as session:
        for model, key in ((Job, "id"), (Task, "job_id")):
            table, columns = model.__tablename__, ", ".join(set(model.__table__.columns.keys()) - {key})
            copied = text(
                f"INSERT INTO {table} ({key}, {columns}) "
                f"SELECT name.value, {columns} FROM {table}, json_each(:names) AS name WHERE {table}.{key} = :copied"
            )
            session.execute(copied, {"names": json.dumps(names), "copied": job_id})
