"""A whole farm renders each tile once: in a job whose turn repeats, and in a second job with the same pixels."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.client.address import read_farm_file
from lippmann.job.states import JobStatus
from lippmann.plan import artifact_names as names
from service.schemas.job import Job
from tests.farm import LIPPMANN, Farm, ended, farm_up
from tests.needs import needs_povray
from tests.waiting import until as wait_until
from worker.images.read import read_rgb

pytestmark = needs_povray

FRAMES = 8
JOB: dict[str, Any] = {
    "scene": "fish",
    "frames": f"1-{FRAMES}",
    "clock": {"repeat_frames": FRAMES // 2},
    "rig": {"lens_array": {"count": [12, 12]}, "px_per_lens": 8},
    "render": {"tiles": [1, 1]},
    "outputs": [],
}


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    # With one slot that is not handed over, no two equal tiles are rendered at the same time.
    env = {"LIPPMANN_HANDOVER": "false"}
    with farm_up(tmp_path_factory.mktemp("farm") / "data", slots=1, env=env) as farm:
        yield farm


@pytest.fixture(scope="module")
def job(farm: Farm) -> Job:
    return done(farm, JOB)


def done(farm: Farm, spec: dict[str, Any]) -> Job:
    job = ended(farm.client, farm.client.submit(spec).id)
    assert job.status is JobStatus.DONE, job.error
    return job


def sheets(farm: Farm, job: Job) -> list[NDArray[np.float16]]:
    folder = farm.data_dir / "artifacts"
    paths = (folder / names.job_artifact(job.id, names.orthoscopic_name(frame + 1)) for frame in range(FRAMES))
    return [read_rgb(path, np.float16) for path in paths]


def command(farm: Farm, *words: str, given: str = "") -> str:
    env = {**os.environ, "LIPPMANN_DATA_DIR": str(farm.data_dir)}
    ran = subprocess.run([LIPPMANN, *words], input=given, capture_output=True, text=True, check=True, env=env)
    return ran.stdout


def remove(farm: Farm, job: Job) -> None:
    address = read_farm_file(farm.data_dir)
    assert address is not None
    headers = {"Authorization": f"Bearer {address.key}"}
    assert httpx.delete(f"{address.url}/api/v1/jobs/{job.id}", headers=headers).is_success
    wait_until(lambda: not (farm.data_dir / "artifacts" / job.id).exists())


def cached_frames(farm: Farm, job: Job) -> list[int]:
    return sorted(task.frame or 0 for task in farm.client.tasks(job.id) if task.cached)


def test_a_job_whose_turn_repeats_after_half_its_frames_renders_half_of_them(farm: Farm, job: Job) -> None:
    assert job.cache_hits == FRAMES // 2
    assert sorted((frame - 1) % (FRAMES // 2) for frame in cached_frames(farm, job)) == [0, 1, 2, 3]
    found = sheets(farm, job)
    for frame in range(FRAMES // 2):
        assert np.array_equal(found[frame], found[frame + FRAMES // 2])
    assert not np.array_equal(found[0], found[1])


def test_a_second_job_renders_nothing_and_has_the_same_pixels(farm: Farm, job: Job) -> None:
    second = done(farm, JOB | {"title": "Once more", "priority": 90, "outputs": ["view_grid.png"]})
    assert (second.cache_hits, cached_frames(farm, second)) == (FRAMES, list(range(1, FRAMES + 1)))
    for first, again in zip(sheets(farm, job), sheets(farm, second), strict=True):
        assert np.array_equal(first, again)
    shown = command(farm, "show", second.id).splitlines()
    assert [line.split() for line in shown if line.startswith("cache hits")] == [["cache", "hits", str(FRAMES)]]


def test_no_cache_renders_every_tile_and_gives_the_same_pixels(farm: Farm, job: Job, tmp_path: Path) -> None:
    said = json.loads(command(farm, "submit", "-", "--watch", "--no-cache", "--json", given=json.dumps(JOB)))
    plain = farm.client.job(said["id"])
    assert (plain.status, plain.cache_hits) == (JobStatus.DONE, 0)
    for first, again in zip(sheets(farm, job), sheets(farm, plain), strict=True):
        assert np.array_equal(first, again)


def test_the_doctor_finds_nothing_and_a_backup_leaves_the_cache_out(farm: Farm, job: Job, tmp_path: Path) -> None:
    assert list((farm.data_dir / "artifacts/cache").rglob("entry.json"))
    command(farm, "doctor", "--deep")
    command(farm, "backup", str(tmp_path / "backup"))
    assert (tmp_path / "backup/artifacts" / job.id).is_dir()
    assert not (tmp_path / "backup/artifacts/cache").exists()


def test_a_second_job_outlives_the_first_and_the_cache(farm: Farm, job: Job) -> None:
    second = done(farm, JOB | {"title": "Heir"})
    assert second.cache_hits == FRAMES
    before = sheets(farm, second)
    for path in (farm.data_dir / "artifacts/cache").rglob("*.*"):
        path.unlink()
    remove(farm, job)
    assert farm.client.repair(second.id).status is not JobStatus.FAILED
    assert ended(farm.client, second.id).status is JobStatus.DONE
    assert all(task.attempt_number == 1 for task in farm.client.tasks(second.id))
    for first, again in zip(before, sheets(farm, second), strict=True):
        assert np.array_equal(first, again)
