"""A machine joins a farm by one file: over TLS, with a bucket, without a database, a shared disk or an environment."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.client import Client
from lippmann.farm.supervisor.descendants import descendants
from lippmann.job.messages.orders import TaskKind
from lippmann.job.spec import JobSpec
from lippmann.join_file import write_join_file
from lippmann.plan import artifact_names as names
from tests.authority import Authority
from tests.broker import Broker, free_port
from tests.builders import local_place, order_of, small_job, stored_job, stored_picture, tiles_of
from tests.farm import LIPPMANN, admin_key, ended, wait_for_slots
from tests.object_store import ObjectStore, running_object_store
from tests.tcp_proxy import tcp_proxy
from tests.waiting import ENOUGH_S, halt
from tests.waiting import until as soon
from worker.images.read import read_rgb
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile

EXIT_REFUSED = 78

NOTHING = {name: value for name, value in os.environ.items() if name in ("PATH", "HOME", "LANG", "TMPDIR")}
"""The environment of a machine that knows nothing of the farm."""


@dataclass
class JoinableFarm:
    """A service on a bucket, with a broker behind TLS and no worker; machines join it."""

    folder: Path
    client: Client
    environment: dict[str, str]
    stack: ExitStack
    workers: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)

    def cli(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([LIPPMANN, *arguments], env=self.environment, capture_output=True, text=True, timeout=300)

    def file(self, name: str) -> Path:
        return self.folder / f"{name}.toml"

    def join(self, name: str) -> subprocess.Popen[bytes]:
        """Start a worker with a join file, and nothing else, in an empty folder."""
        place = self.folder / name
        place.mkdir(exist_ok=True)
        with (self.folder / f"{name}.log").open("ab") as log:
            worker = subprocess.Popen(
                [LIPPMANN, "worker", "--slots", "1", "--join", str(self.file(name))],
                env=NOTHING | {"LIPPMANN_WORKER_NAME": name}, cwd=place, stdout=log, stderr=subprocess.STDOUT,
            )  # fmt: skip
        self.stack.callback(_end, worker)
        return worker

    def log(self, name: str) -> str:
        return (self.folder / f"{name}.log").read_text()


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    process.wait(ENOUGH_S)


@pytest.fixture(scope="module")
def objects() -> Iterator[ObjectStore]:
    with running_object_store() as store:
        yield store


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory, objects: ObjectStore) -> Iterator[JoinableFarm]:
    folder = tmp_path_factory.mktemp("join")
    authority, broker, port, key_file = Authority(folder), Broker(folder), free_port(), folder / "admin.key"
    with ExitStack() as stack:
        stack.callback(broker.kill)
        context = authority.server_context("127.0.0.1")

        def behind_tls(port: int) -> str:
            proxy = stack.enter_context(tcp_proxy(("127.0.0.1", port), tls=context))
            assert isinstance(proxy.address, tuple)
            return f"127.0.0.1:{proxy.address[1]}"

        environment = {
            **os.environ,
            "LIPPMANN_REDIS_URL": f"rediss://{behind_tls(broker.port)}/0",
            "LIPPMANN_REDIS_CA_FILE": str(authority.ca_file),
            "LIPPMANN_STORE_URL": f"s3://{objects.new_bucket()}/farm",
            "LIPPMANN_S3_ENDPOINT": f"https://{behind_tls(objects.port)}",
            "AWS_CA_BUNDLE": str(authority.ca_file),
            "LIPPMANN_DATA_DIR": str(folder / "service"),
            "LIPPMANN_WORKERS_NEED_KEYS": "true",
        }
        with (folder / "service.log").open("ab") as log:
            service = subprocess.Popen(
                [LIPPMANN, "serve", "--port", str(port), "--key-file", str(key_file)],
                env=environment, stdout=log, stderr=subprocess.STDOUT,
            )  # fmt: skip
        stack.callback(_end, service)
        key = admin_key(key_file)
        url = f"http://127.0.0.1:{port}"
        with Client(url, key, patience_s=ENOUGH_S) as client:
            client.health()
            yield JoinableFarm(folder, client, environment | {"LIPPMANN_URL": url, "LIPPMANN_KEY": key}, stack)


def done_renders(farm: JoinableFarm, job_id: str) -> set[str] | None:
    """Return the tasks that have rendered a frame; None before the job is planned."""
    renders = [task for task in farm.client.tasks(job_id) if task.kind == "render"]
    return {task.id for task in renders if task.status == "done"} if renders else None


def halt_povray(worker: subprocess.Popen[bytes]) -> bool:
    """Halt a POV-Ray of a worker, so that its attempt does not end by itself; return whether there was one."""
    for pid in descendants(worker.pid):
        with suppress(OSError):
            if Path(f"/proc/{pid}/comm").read_text().strip() == "povray":
                halt(pid)
                return True
    return False


def rendered_here(spec: JobSpec, folder: Path) -> NDArray[np.float16]:
    """Return the first frame, rendered without a farm."""
    place = local_place(folder)
    stored_job(place, spec)
    render_tile(place, order_of(TaskKind.RENDER, tile=tiles_of(spec)[0]), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    return stored_picture(place, names.orthoscopic_name(1))


@pytest.mark.promise(
    "Between processes", "What a worker with a revoked key does counts no more, and its tasks go to others."
)
def test_a_machine_joins_by_a_file_and_the_farm_goes_on_when_its_key_is_revoked_in_mid_job(
    farm: JoinableFarm, tmp_path: Path
) -> None:
    made = farm.client.create_worker_key("shared user", broker_user="given")
    write_join_file(farm.file("one"), made.join)
    one = farm.join("one")
    wait_for_slots(farm.client, 1)
    spec = small_job("fish", count=(48, 36), frames="1-2")
    job = farm.client.submit(spec.model_dump(mode="json"))
    soon(lambda: done_renders(farm, job.id) is not None and halt_povray(one))
    farm.client.revoke_key(made.id)
    assert one.wait(ENOUGH_S) == EXIT_REFUSED
    assert f"the farm refuses the key {made.id} of this worker: it was revoked" in farm.log("one")
    assert farm.join("one").wait(ENOUGH_S) == EXIT_REFUSED, "it is told at its next start too"
    by_one = done_renders(farm, job.id)
    assert by_one is not None
    assert len(by_one) < 2, "the attempt that was halted has not ended"

    created = farm.cli("keys", "create", "own user", "--worker", "--days", "1", "--out", str(farm.file("two")))
    assert created.returncode == 0, created.stderr
    assert "127.0.0.1, which other machines do not reach" in created.stderr
    two = farm.join("two")
    done = ended(farm.client, job.id)
    assert done.status == "done", done.error
    renders = [task for task in farm.client.tasks(job.id) if task.kind == "render"]
    assert {task.worker for task in renders if task.id not in by_one} == {"two"}
    farm.client.download(job.id, names.orthoscopic_name(1), tmp_path / "first.exr")
    assert np.array_equal(read_rgb(tmp_path / "first.exr", np.float16), rendered_here(spec, tmp_path))
    assert sorted(path.name for path in (farm.folder / "two").iterdir()) == ["data"]
    assert sorted(path.name for path in (farm.folder / "two/data").iterdir()) == ["join", "scratch"]
    (key,) = farm.client.worker_keys()
    assert (key.name, key.used_at is not None, key.has_broker_user) == ("own user", True, True)
    farm.client.revoke_key(key.id)
    soon(lambda: "refuses the user of this worker, whose key may be revoked" in farm.log("two"))
    assert two.poll() is None


def test_an_expired_file_and_one_that_others_may_read_are_refused_at_the_start(farm: JoinableFarm) -> None:
    join = farm.client.create_worker_key("late", expires_in_days=1, broker_user="given").join
    assert join.worker.expires_at is not None
    late = join.worker.model_copy(update={"expires_at": join.worker.expires_at.replace(year=2020)})
    write_join_file(farm.file("late"), join.model_copy(update={"worker": late}))
    assert farm.join("late").wait(ENOUGH_S) == 2
    assert f"the worker key {join.worker.id} expired at 2020-" in farm.log("late")
    write_join_file(farm.file("open"), join)
    farm.file("open").chmod(0o644)
    assert farm.join("open").wait(ENOUGH_S) == 2
    assert "chmod 600" in farm.log("open")
