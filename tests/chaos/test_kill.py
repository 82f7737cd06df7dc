"""Kill -9 at the worst moment: the job ends right, and its pixels are those of an undisturbed run."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from redis import Redis

from lippmann.job.messages.orders import TaskKind
from lippmann.job.outputs.videos import CentreVideo
from lippmann.job.spec import JobSpec
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import cut_tiles, frame_size
from service.schemas.job import Job
from tests.builders import local_place, order_of, small_job, stored_job, stored_picture
from tests.farm import Farm, ended, farm_up, until
from worker.images.read import read_rgb
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.frames.render import render_tile

QUICK = {"LIPPMANN_LEASE_TTL_S": "8", "LIPPMANN_UNCLAIMED_S": "6", "LIPPMANN_RECONCILE_S": "1"}
"""A lost attempt is noticed in 8 s instead of 45, so that the test is short; heartbeats stay at 5 s."""


def fish(frames: str) -> JobSpec:
    spec = small_job("fish", count=(60, 60), frames=frames, tiles=[2, 1])
    return spec.model_copy(update={"outputs": (CentreVideo(),)})


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> NDArray[np.float16]:
    """Frame 1, rendered without a farm."""
    place = local_place(tmp_path_factory.mktemp("undisturbed"))
    spec = fish("1")
    stored_job(place, spec)
    for tile in cut_tiles(frame_size(spec.rig), tile_rows=2, tile_cols=1):
        render_tile(place, order_of(TaskKind.RENDER, tile=tile), NullMonitor())
    assemble_frame(place, order_of(TaskKind.ASSEMBLE), NullMonitor())
    return stored_picture(place, names.orthoscopic_name(1))


def first_frame(farm: Farm, job: Job) -> NDArray[np.float16]:
    path = farm.data_dir / "artifacts" / names.job_artifact(job.id, names.orthoscopic_name(1))
    return read_rgb(path, np.float16)


def rendering(job: Job) -> bool:
    return bool(job.status == "running" and job.tasks.running and job.progress > 0.02)


def assert_all_there_once(farm: Farm, job: Job) -> None:
    assert job.status == "done", job.error
    assert job.frames_done == job.frames_total
    tasks = list(farm.client.tasks(job.id))
    assert all(task.status == "done" for task in tasks)
    assert sum(task.kind == "render" for task in tasks) == 2 * job.frames_total


def test_a_worker_killed_in_mid_frame_costs_time_and_nothing_else(
    tmp_path: Path, undisturbed: NDArray[np.float16]
) -> None:
    with farm_up(tmp_path / "data", env=QUICK) as farm:
        job = farm.client.submit(fish("1-3"))
        until(farm.client, job.id, rendering)
        (worker,) = farm.client.workers().items
        os.kill(worker.pid, signal.SIGKILL)
        job = ended(farm.client, job.id)
        assert_all_there_once(farm, job)
        assert any(task.attempt_number > 1 for task in farm.client.tasks(job.id)), "the kill hit an attempt"
        assert (first_frame(farm, job) == undisturbed).all()


def test_a_farm_killed_in_mid_job_goes_on_when_it_is_started_again(
    tmp_path: Path, undisturbed: NDArray[np.float16]
) -> None:
    with farm_up(tmp_path / "data", env=QUICK) as farm:
        job = farm.client.submit(fish("1-3"))
        until(farm.client, job.id, rendering)
        farm.kill()
    with farm_up(tmp_path / "data", env=QUICK) as farm:
        job = ended(farm.client, job.id)
        assert_all_there_once(farm, job)
        assert (first_frame(farm, job) == undisturbed).all()


def test_a_broker_wiped_in_mid_job_loses_nothing(tmp_path: Path, undisturbed: NDArray[np.float16]) -> None:

    with farm_up(tmp_path / "data", env=QUICK) as farm:
        job = farm.client.submit(fish("1-3"))
        until(farm.client, job.id, rendering)
        Redis.from_url(f"unix://{next((tmp_path / 'data').rglob('*.sock'))}").flushall()
        job = ended(farm.client, job.id)
        assert_all_there_once(farm, job)
        assert (first_frame(farm, job) == undisturbed).all()
