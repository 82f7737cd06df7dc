"""A farm whose disk runs full, is read-only, or is away: jobs are paused with the reason and go on by themselves."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from lippmann.cli.text.jobs import job_text
from lippmann.client import Client
from lippmann.client.errors import Refused
from lippmann.errors import LippmannError
from lippmann.job.states import JobStatus, PausedBy
from service.schemas.job import Job
from tests.disks import Disk, away, read_only, small_disk
from tests.farm import Farm, farm_up
from tests.needs import needs_povray
from tests.waiting import until

pytestmark = needs_povray

JOB = {
    "scene": "target-white",
    "frames": "1-400",
    "rig": {"px_per_lens": 2, "lens_array": {"count": [4, 4]}},
    "render": {"cache": False},
}
"""Many frames of almost no work, each rendered although they are equal."""
CAUSES = {
    "full": r"The artifact store has no room left: \d+ MB are free, and 50 MB are kept in reserve\.",
    "no inodes": r"The artifact store has no room left: \d+ inodes are free, and 100 are kept in reserve\.",
    "read-only": r"The artifact store cannot be written: Read-only file system\.",
    "away": r"The artifact store cannot be written: No such file or directory\.",
}


@pytest.fixture(scope="module")
def disk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Disk]:
    with small_disk(tmp_path_factory.mktemp("disk") / "disk", mb=300, inodes=6000) as disk:
        yield disk


@pytest.fixture(scope="module")
def farm(disk: Disk) -> Iterator[Farm]:
    with farm_up(disk.path / "data", env={"LIPPMANN_STORE_CHECK_S": "1"}) as farm:
        yield farm


@pytest.fixture(scope="module")
def job_id(farm: Farm) -> str:
    return farm.client.submit(JOB).id


@contextmanager
def _broken(cause: str, disk: Disk) -> Iterator[None]:
    store = disk.path / "data" / "artifacts"
    if cause in ("read-only", "away"):
        with read_only(store) if cause == "read-only" else away(store):
            yield
        return
    disk.fill() if cause == "full" else disk.use_up_inodes()
    yield
    disk.free()


def _next_frame(client: Client, job_id: str) -> Job:
    before = client.job(job_id).frames_done
    return until(lambda: (job := client.job(job_id)).frames_done > before and job)  # type: ignore[no-any-return]


@pytest.mark.parametrize("cause", CAUSES)
def test_a_job_is_paused_says_why_and_goes_on_when_the_cause_has_gone(
    farm: Farm, job_id: str, disk: Disk, cause: str
) -> None:
    client = farm.client
    assert _next_frame(client, job_id).status is JobStatus.RUNNING
    with _broken(cause, disk):
        paused: Job = until(lambda: (job := client.job(job_id)).status is JobStatus.PAUSED and job)
        assert paused.pause is not None
        reason = paused.pause.reason or ""
        assert paused.pause.by is PausedBy.FARM
        assert re.fullmatch(CAUSES[cause], reason)
        assert f"by the farm: {reason}" in job_text(paused)
        health = client.health()
        assert (health.status, health.store.ok, health.store.detail) == ("degraded", False, reason)
        # A client waits for a store that is away to come back; this one does not.
        impatient = Client(client.address.url, client.address.key, patience_s=0.0)
        with impatient, pytest.raises(LippmannError) as refused:
            impatient.submit(JOB)
        assert "no room" in str(refused.value) or "the store" in str(refused.value)
        if cause in ("full", "no inodes"):
            assert isinstance(refused.value, Refused)
            assert refused.value.status == 507
        client.resume(job_id)
        until(lambda: client.job(job_id).status is JobStatus.PAUSED)
    assert _next_frame(client, job_id).status is JobStatus.RUNNING
    assert client.health().status == "ok"
    assert not [task for task in client.tasks(job_id) if task.failures]


def test_a_job_is_cancelled_and_removed_though_the_disk_is_full_which_makes_room(
    farm: Farm, job_id: str, disk: Disk
) -> None:
    client = farm.client
    kept = disk.path / "data" / "artifacts" / job_id
    disk.fill()
    until(lambda: client.job(job_id).status is JobStatus.PAUSED)
    assert client.cancel(job_id).status is JobStatus.CANCELLED
    client.delete(job_id)
    until(lambda: not kept.exists())
    disk.free()
