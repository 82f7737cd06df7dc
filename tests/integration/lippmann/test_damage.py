"""A real farm repairs what is damaged on its disk: by itself while a job runs, by `repair`, and for whoever asks."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from lippmann.client import Refused
from lippmann.job.states import JobStatus
from service.schemas.job import Job
from tests.damaging import DAMAGES, Damage, delete, empty, flip, truncate
from tests.farm import LIPPMANN, Farm, ended, farm_up, until
from tests.needs import needs_povray

pytestmark = needs_povray

SPEC: dict[str, Any] = {
    "scene": "fish",
    "frames": "1-3",
    "rig": {"lens_array": {"count": [30, 30]}, "px_per_lens": 8},
    "render": {"tiles": [2, 1]},
    "capture": {"depth": True},
    "outputs": ["views.mp4", "view_grid.png"],
}
UNCACHED = {"tiles": [2, 1], "cache": False}


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    with farm_up(tmp_path_factory.mktemp("farm")) as farm:
        yield farm


@pytest.fixture(scope="module")
def job(farm: Farm) -> Job:
    done = ended(farm.client, farm.client.submit(SPEC).id)
    assert done.status is JobStatus.DONE
    return done


def made(farm: Farm, job_id: str) -> dict[str, bytes]:
    """Return every file of a job that tasks make, except the logs."""
    folder = farm.data_dir / "artifacts" / job_id
    paths = [path for path in sorted(folder.rglob("*.*")) if path.is_file()]
    return {name: path.read_bytes() for path in paths if not (name := str(path.relative_to(folder))).startswith("log/")}


def attempts(farm: Farm, job_id: str) -> dict[str, int]:
    """Return the number of attempts of each task of a job, by its artifact."""
    return {task.artifact: task.attempt_number for task in farm.client.tasks(job_id)}


def path_of(farm: Farm, job_id: str, name: str) -> Path:
    return farm.data_dir / "artifacts" / job_id / name


def test_repair_makes_every_kind_of_damage_good_to_the_last_byte(farm: Farm, job: Job) -> None:
    before, first = made(farm, job.id), attempts(farm, job.id)
    truncate(path_of(farm, job.id, "tiles/0001/01-00.exr"))
    flip(path_of(farm, job.id, "depth-tiles/0002/00-00.exr"))
    empty(path_of(farm, job.id, "views/0003.exr"))
    delete(path_of(farm, job.id, "depth/0001.exr"))
    flip(path_of(farm, job.id, "video/views.mp4"))
    truncate(path_of(farm, job.id, "exports/view_grid/0002.png"))
    command = [LIPPMANN, "repair", job.id, "--data-dir", str(farm.data_dir)]
    ran = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    assert ran.stdout == f"{job.id} running\n"
    again = ended(farm.client, job.id)
    assert (again.status, again.error) == (JobStatus.DONE, None)
    assert made(farm, job.id) == before
    second = attempts(farm, job.id)
    assert {name for name, number in second.items() if number > first[name]} == {
        "tiles/0001/01-00.exr", "tiles/0002/00-00.exr", "thumbs/0001.webp", "thumbs/0003.webp", "video/views.mp4",
        "exports/view_grid.png.json",
    }  # fmt: skip


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", ["integral/0002.exr"])
def test_a_download_of_a_damaged_file_waits_and_brings_the_whole_one(
    farm: Farm, job: Job, tmp_path: Path, damage: Damage, name: str
) -> None:
    before = made(farm, job.id)
    farm.client.repair(job.id)
    ended(farm.client, job.id)
    damage(path_of(farm, job.id, name))
    farm.client.download(job.id, name, tmp_path / "brought.exr")
    assert (tmp_path / "brought.exr").read_bytes() == before[name]
    assert ended(farm.client, job.id).status is JobStatus.DONE
    assert made(farm, job.id) == before


def test_a_master_that_is_damaged_in_mid_job_is_assembled_again_before_the_video(farm: Farm, job: Job) -> None:
    job_id = farm.client.submit(SPEC | {"frames": "1-6", "outputs": ["orthoscopic.mp4"], "render": UNCACHED}).id
    until(farm.client, job_id, lambda job: job.frames_done >= 1)
    damaged = next(path for path in sorted(path_of(farm, job_id, "orthoscopic").glob("*.exr")))
    whole = damaged.read_bytes()
    flip(damaged)
    assert farm.client.job(job_id).frames_done < 6
    done = ended(farm.client, job_id)
    assert (done.status, done.error) == (JobStatus.DONE, None)
    assert damaged.read_bytes() == whole
    tasks = {task.artifact: task for task in farm.client.tasks(job_id)}
    assert tasks[f"thumbs/{damaged.stem}.webp"].attempt_number == 2
    assert tasks["video/orthoscopic.mp4"].attempt_number == 2
    assert tasks["video/orthoscopic.mp4"].failures == 0


def test_a_file_that_is_damaged_again_is_refused_with_the_advice_to_repair(farm: Farm, tmp_path: Path) -> None:
    job_id = farm.client.submit(SPEC | {"frames": "1", "capture": {}, "outputs": []}).id
    assert ended(farm.client, job_id).status is JobStatus.DONE
    name = "orthoscopic/0001.exr"
    flip(path_of(farm, job_id, name))
    farm.client.download(job_id, name, tmp_path / "once.exr")
    assert ended(farm.client, job_id).status is JobStatus.DONE
    flip(path_of(farm, job_id, name))
    with pytest.raises(Refused, match="the action `repair` of the job makes it again"):
        farm.client.download(job_id, name, tmp_path / "twice.exr")
    assert not (tmp_path / "twice.exr").exists()
