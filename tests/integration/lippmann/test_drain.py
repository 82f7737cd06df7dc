"""Two real workers: each does the jobs that it fits, and both are drained in mid-job without a lost attempt."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import pytest

from lippmann.client import Client
from lippmann.client.errors import Refused
from service.schemas.job import Job
from tests.broker import Broker, free_port
from tests.builders import small_job
from tests.farm import LIPPMANN, admin_key, ended, wait_for_slots
from tests.integration.lippmann.conftest import run
from tests.needs import needs_povray
from tests.waiting import ENOUGH_S, until

pytestmark = needs_povray

JOB = small_job("fish", count=(20, 20), frames="1", render={"cache": False}).model_copy(update={"outputs": ()})


@dataclass
class TwoWorkers:
    client: Client
    address: dict[str, str]
    plain: subprocess.Popen[bytes]
    tagged: subprocess.Popen[bytes]

    def submit(self, frames: str, **workers: object) -> Job:
        return self.client.submit(JOB.model_dump(mode="json") | {"frames": frames, "workers": workers})

    def workers_of(self, job: Job) -> set[str | None]:
        return {task.worker for task in self.client.tasks(job.id)}

    def is_at_work(self, job: Job, worker: str) -> bool:
        tasks = self.client.tasks(job.id)
        return any((task.worker, task.status, task.kind) == (worker, "running", "render") for task in tasks)


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TwoWorkers]:
    folder = tmp_path_factory.mktemp("farm")
    broker, port, key_file = Broker(folder), free_port(), folder / "admin.key"
    shared = {
        **os.environ, "LIPPMANN_REDIS_URL": broker.url, "LIPPMANN_DATA_DIR": str(folder / "data"),
        # No test ends by these times: what is lost shows.
        "LIPPMANN_LEASE_TTL_S": "100000", "LIPPMANN_UNCLAIMED_S": "100000",
    }  # fmt: skip
    with ExitStack() as stack:
        stack.callback(broker.kill)

        def start(*command: str, **env: str) -> subprocess.Popen[bytes]:
            process = subprocess.Popen([LIPPMANN, *command], env=shared | env)
            stack.callback(_end, process)
            return process

        start("serve", "--port", str(port), "--key-file", str(key_file))
        key = admin_key(key_file)
        until((folder / "data/order.key").exists)
        plain = start("worker", "--slots", "1", LIPPMANN_WORKER_NAME="plain")
        tagged = start(
            "worker", "--slots", "1", "--tag", "gpu", LIPPMANN_WORKER_NAME="tagged", LIPPMANN_DRAIN_S="600"
        )  # fmt: skip
        url = f"http://127.0.0.1:{port}"
        with Client(url, key, patience_s=ENOUGH_S) as client:
            wait_for_slots(client, 2)
            yield TwoWorkers(client, {"LIPPMANN_URL": url, "LIPPMANN_KEY": key}, plain, tagged)


def _end(process: subprocess.Popen[bytes]) -> None:
    for number in (signal.SIGTERM, signal.SIGTERM):  # the second one ends a worker that drains
        process.send_signal(number)
    process.wait(ENOUGH_S)


def test_workers_of_two_kinds_are_drained_in_mid_job_and_lose_no_attempt(farm: TwoWorkers) -> None:
    client = farm.client
    for_tagged, for_all = farm.submit("1-2", tags=["gpu"]), farm.submit("1-10")
    for_nobody = farm.submit("1", tags=["none"])
    until(lambda: farm.is_at_work(for_all, "plain"))
    drained = run("workers", "drain", "plain", "--exit", **farm.address)
    assert (drained.returncode, drained.stdout) == (
        0, "plain takes no further orders and ends when its tasks are done.\n",
    )  # fmt: skip
    closed = until(lambda: [one.closed for one in client.workers().items if one.name == "plain"])
    assert farm.plain.wait(ENOUGH_S) == 0
    assert closed in ([None], ["draining"])
    until(lambda: [one.name for one in client.workers().items] == ["tagged"])
    assert (ended(client, for_tagged.id).status, ended(client, for_all.id).status) == ("done", "done")
    assert farm.workers_of(for_tagged) == {"tagged"}
    assert farm.workers_of(for_all) == {"plain", "tagged"}
    wait = client.job(for_nobody.id).wait
    assert wait is not None
    assert (wait.code, "the tag none" in wait.message) == ("no-fitting-worker", True)

    client.drain("tagged")
    until(lambda: client.workers().items[0].closed == "draining")
    again = farm.submit("1-2", tags=["gpu"])
    # For a moment it is about to start: what the job waits for is known a moment after the worker is.
    wait = until(lambda: (seen := client.job(again.id).wait) and seen.code == "workers-closed" and seen)
    assert (wait.code, wait.message) == (
        "workers-closed", "No worker that may do it takes orders: tagged is drained.",
    )  # fmt: skip
    client.undrain("tagged")
    until(lambda: client.workers().items[0].closed is None)
    client.exclude("tagged")
    until(lambda: client.workers().items[0].closed == "draining")
    assert [(one.worker, one.name) for one in client.workers().excluded] == [("tagged", client.caller().name)]
    client.include("tagged")
    with pytest.raises(Refused, match="there is no worker 'no one' online"):
        client.drain("no one")
    changes = [(entry.action, entry.subject, entry.detail) for entry in client.audit() if entry.subject != again.id]
    assert changes[:5] == [
        ("include-worker", "tagged", ""), ("exclude-worker", "tagged", ""), ("undrain-worker", "tagged", ""),
        ("drain-worker", "tagged", ""), ("drain-worker", "plain", "ends afterwards"),
    ]  # fmt: skip
    with pytest.raises(Refused, match="no job has a failure of the worker 'tagged'"):
        client.forgive("tagged")
    task = next(client.tasks(for_all.id)).id
    for act, expected in ((client.restart_task, "dispatched or running"), (client.end_task, "running")):
        with pytest.raises(Refused, match=f"cannot stop a task that is done; expected one that is {expected}"):
            act(for_all.id, task)
    until(lambda: farm.is_at_work(again, "tagged"))
    farm.tagged.send_signal(signal.SIGTERM)
    assert farm.tagged.wait(ENOUGH_S) == 0
    left = client.job(again.id)
    assert left.tasks.running == 0
    assert left.tasks.done >= 2
    # An order that comes from the broker while a worker drains goes back, and on a busy machine it is given up for lost
    # meanwhile. That is another attempt, but none that a worker had begun: those name their worker.
    tasks = [task for job in (for_tagged, for_all, again) for task in client.tasks(job.id)]
    assert [task.id for task in tasks if task.failed_on or task.failures] == [], "no attempt that was begun was lost"
