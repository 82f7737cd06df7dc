"""A farm on PostgreSQL and a bucket: the same jobs and the same pixels, and the store may be away for a while."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from tests.builders import small_job
from tests.cluster import Cluster, cluster_up
from tests.farm import LIPPMANN, ended, until
from tests.object_store import ObjectStore, running_object_store
from tests.postgresql import postgresql as postgresql
from tests.waiting import ENOUGH_S
from tests.waiting import until as wait_until
from tests.without_farm import masters_without_farm
from worker.images.read import read_rgb

FRAMES = 4


@pytest.fixture(scope="module")
def objects() -> Iterator[ObjectStore]:
    """An S3 server of this module's own, which it kills; with its keys in the environment."""
    with running_object_store() as store:
        yield store


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory, postgresql: str, objects: ObjectStore) -> Iterator[Cluster]:
    with cluster_up(tmp_path_factory.mktemp("cluster"), postgresql=postgresql, objects=objects) as up:
        yield up


def fish(frames: str) -> JobSpec:
    return small_job("fish", count=(24, 20), frames=frames, tiles=[2, 1])


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> NDArray[np.float16]:
    """Frame 1, rendered without a farm."""
    return masters_without_farm(tmp_path_factory.mktemp("undisturbed"), fish("1"))[1]


def first_frame(cluster: Cluster, job_id: str, folder: Path) -> NDArray[np.float16]:
    path = folder / "first.exr"
    cluster.client.download(job_id, names.orthoscopic_name(1), path)
    return read_rgb(path, np.float16)


def assert_doctor_finds_nothing(cluster: Cluster) -> None:
    command = [LIPPMANN, "doctor", "--deep", "--json", "--data-dir", str(cluster.data_dir("service"))]
    ran = subprocess.run(command, env=cluster.environment, capture_output=True, text=True, timeout=600)
    found = json.loads(ran.stdout)
    assert [finding for finding in found["findings"] if finding["level"] == "error"] == []
    assert ran.returncode == 0, ran.stdout + ran.stderr


def test_processes_that_share_only_broker_database_and_bucket_do_a_job(
    cluster: Cluster, undisturbed: NDArray[np.float16], tmp_path: Path
) -> None:
    spec = {**fish(f"1-{FRAMES}").model_dump(mode="json"), "outputs": ["views.mp4", "orthoscopic.mkv"]}
    job = ended(cluster.client, cluster.client.submit(spec).id)
    assert job.status == "done", job.error
    assert {task.worker for task in cluster.client.tasks(job.id) if task.kind == "render"} == {"worker0", "worker1"}
    assert np.array_equal(first_frame(cluster, job.id, tmp_path), undisturbed)
    assert not any((cluster.data_dir(name) / "artifacts").exists() for name in ("service", "worker0", "worker1"))
    assert_doctor_finds_nothing(cluster)


def test_a_store_that_is_killed_in_mid_job_and_comes_back_loses_nothing(
    cluster: Cluster, objects: ObjectStore, undisturbed: NDArray[np.float16], tmp_path: Path
) -> None:
    job = cluster.client.submit(
        fish(f"1-{FRAMES}").model_dump(mode="json") | {"render": {"cache": False, "tiles": [2, 1]}}
    )
    until(cluster.client, job.id, lambda job: job.tasks.running)
    objects.kill()
    until(cluster.client, job.id, lambda _: cluster.client.health().faults)
    assert "the server does not answer" in str(cluster.client.health().faults)
    objects.start()
    job = ended(cluster.client, job.id)
    assert job.status == "done", job.error
    assert np.array_equal(first_frame(cluster, job.id, tmp_path), undisturbed)
    assert_doctor_finds_nothing(cluster)


def test_a_worker_with_a_wrong_key_harms_no_job_and_its_log_names_the_reason(cluster: Cluster) -> None:
    wrong = {"LIPPMANN_WORKER_NAME": "wrong", "LIPPMANN_DATA_DIR": str(cluster.data_dir("wrong"))}
    environment = {**cluster.environment, **wrong, "AWS_SECRET_ACCESS_KEY": "another-secret"}
    log = cluster.folder / "wrong.log"
    with log.open("wb") as output:
        command = [LIPPMANN, "worker", "--slots", "1"]
        worker = subprocess.Popen(command, env=environment, stdout=output, stderr=subprocess.STDOUT)
    try:
        wait_until(lambda: "the store cannot be used" in log.read_text())
        spec = fish("1-2").model_dump(mode="json") | {"render": {"cache": False, "tiles": [2, 1]}}
        job = ended(cluster.client, cluster.client.submit(spec).id)
        assert (job.status, job.frames_done) == ("done", 2), job.error
        assert {task.failures for task in cluster.client.tasks(job.id)} == {0}
        assert "wrong" not in {task.worker for task in cluster.client.tasks(job.id)}
        assert "attempt failed" in log.read_text()
        assert "the secret key is not that of the access key" in log.read_text()
        assert "another-secret" not in log.read_text()
    finally:
        worker.terminate()
        worker.wait(ENOUGH_S)
