"""A farm that has something of everything that the API describes, and callers of every role."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import select

from lippmann.farm.adapters import make_parts
from lippmann.job.messages.orders import TaskKind
from lippmann.job.states import JobStatus, TaskStatus
from lippmann.plan import artifact_names as names
from service.auth import create_key
from service.db.drains import exclude, set_drain
from service.db.tables import Job, Task, WorkerFault
from service.dependencies import COOKIE
from service.ids import task_id
from service.main import create_app
from service.schemas.access import Role
from tests.broker import Broker
from tests.browser.studio import RIG, Studio
from tests.builders_messages import put_presence, seals_in
from tests.builders_service import Client, Farm, presence
from tests.preview_worker import Answering
from worker.store.opening import local_store

JOB: dict[str, Any] = {
    "scene": "fish",
    "frames": "1-2",
    "rig": RIG,
    "render": {"tiles": [1, 1]},
    "outputs": ["views.mp4"],
}
NOBODY = "nobody"
WORKER = presence("w1").model_copy(update={"instance": "i1", "previews": True})
"""The worker that is online."""


@dataclass
class ContractFarm:
    """The application in this process, real pictures in its store, and the ids of what it has."""

    farm: Farm
    client: Client
    keys: dict[str, str]
    """The key of each role; nobody has an empty one."""
    done_job: str
    """A job that ended well, which nothing changes."""
    planned_job: str
    task: str
    """A task of the job that ended well, with a log."""
    artifacts: list[str]
    """The names of its files."""
    bundle: bytes
    """A scene to upload."""

    def new_job(self, status: JobStatus, *, is_kept: bool) -> str:
        """Return a job with a status, for a request that changes it; a failed one that is kept was planned."""
        job_id = self.planned_job if status is JobStatus.FAILED and is_kept else self.farm.submit(**JOB)
        with self.farm.writing() as session:
            session.get_one(Job, job_id).status = status
        return job_id

    def link_token(self, artifact: str) -> str:
        """Return the token of a link to a file."""
        headers = {"Authorization": f"Bearer {self.keys[Role.ADMIN]}"}
        answer = self.client.post(f"/api/v1/jobs/{self.done_job}/links", json={"artifact": artifact}, headers=headers)
        return str(answer.json()["url"]).partition("token=")[2]

    def new_scene(self) -> str:
        """Return the name of a scene that may be removed."""
        headers = {"Authorization": f"Bearer {self.keys[Role.ADMIN]}"}
        files = {"bundle": ("spare.zip", self.bundle)}
        self.client.post("/api/v1/scenes", params={"name": "removable"}, files=files, headers=headers)
        return "removable"

    def new_session(self) -> str:
        """Return the id of a browser session that may be ended."""
        self.client.post("/login", data={"key": self.keys[Role.VIEWER]})
        session_id = str(self.client.cookies[COOKIE]).partition(".")[0]
        self.client.cookies.clear()
        return session_id

    def held_task(self) -> dict[str, object]:
        """Return a job and a task of it that a worker runs."""
        with self.farm.writing() as session:
            job = session.get_one(Job, self.planned_job)
            task = session.scalars(select(Task).where(Task.job_id == job.id, Task.kind == TaskKind.RENDER)).first()
            assert task is not None
            job.status, task.status, task.attempt, task.worker = JobStatus.RUNNING, TaskStatus.RUNNING, "a", "w1"
            return {"job_id": job.id, "task_id": task_id(job.id, task.sequence)}

    def marked_worker(self) -> str:
        """Return the name of a worker that is drained and excluded, and that a job avoids."""
        with self.farm.writing() as session:
            set_drain(session, WORKER.name, str(WORKER.instance), ends=False, now_s=self.farm.now_s)
            exclude(session, WORKER.name, name="admin", now_s=self.farm.now_s)
            session.merge(WorkerFault(job_id=self.done_job, worker=WORKER.name, failures=1))
        return WORKER.name

    def new_key(self) -> str:
        """Return the id of a key that may be revoked."""
        with self.farm.writing() as session:
            return create_key(session, "spare", Role.VIEWER)[0]


@contextmanager
def contract_farm(folder: Path) -> Iterator[ContractFarm]:
    """Lend a farm with a worker that is online, whose event streams end at once and whose rates nobody exceeds.

    Its setting of the store is a bucket, so that machines may join it, although its artifacts lie in a folder.
    """
    broker = Broker(folder)
    put_presence(broker.client, WORKER, seals_in(folder), ex=24 * 3600)
    farm = Farm(
        f"sqlite:///{folder}/farm.db", given=make_parts(local_store(folder)), data_dir=folder, coordinator=False,
        redis_url=broker.url, store_url="s3://farm", requests_per_minute=10**9, requests_per_minute_by_address=10**9,
        max_open_jobs=10**9, max_open_frames=10**9, previews_per_minute=10**9,
    )  # fmt: skip
    job_id = _done_job(farm)
    task = _logged_task(farm, job_id)
    planned = farm.planned(**JOB)
    keys = {NOBODY: ""}
    with farm.writing() as session:
        for role in Role:
            keys[role] = create_key(session, role.value, role)[1]
    app = create_app(farm.settings, farm.parts, clock=lambda: farm.now_s)
    with (
        Answering(broker.url, seals=seals_in(folder)),
        Client(app, raise_server_exceptions=False, follow_redirects=False) as client,
    ):
        app.state.lippmann.hub.end_streams()
        prefix = names.job_artifact(job_id, "")
        files = [item.name.removeprefix(prefix) for item in farm.parts.store.list(prefix)]
        yield ContractFarm(farm, client, keys, job_id, planned, task, files, farm.parts.scenes.builtin()["fish"])
    farm.database.dispose()
    broker.kill()


def _done_job(farm: Farm) -> str:
    """Render a job with a worker that hands in real pictures and a real video."""
    job_id, studio = farm.planned(**JOB), Studio(farm.parts.store)
    while orders := farm.dispatch():
        for order in orders:
            farm.say(*studio(order))
        farm.plan()
    assert farm.job(job_id).status is JobStatus.DONE
    video = f"video/{JOB['outputs'][0]}"
    farm.parts.store.put_bytes(names.job_artifact(job_id, f"{video}.json"), json.dumps({"files": [video]}).encode())
    return job_id


def _logged_task(farm: Farm, job_id: str) -> str:
    """Store a log for a task."""
    task = farm.tasks(job_id)[1]
    name = names.log_name(task.kind, task.frame, task.tile, task.output, task.attempt_number)
    farm.parts.store.put_bytes(names.job_artifact(job_id, name), b"Parsing...")
    return task_id(job_id, task.sequence)
