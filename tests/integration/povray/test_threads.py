"""A frame that has all slots of a worker is rendered by several threads, with the pixels of a single one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from lippmann.job.messages.orders import TaskKind
from lippmann.plan import artifact_names as names
from tests.builders import order_of, small_job, stored_job, tiles_of
from worker.settings import WorkerSettings
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace, workplace
from worker.tasks.frames.render import render_tile
from worker.tasks.local import JOB_ID
from worker.tasks.probe import probe_job


@pytest.fixture
def place(tmp_path: Path) -> Workplace:
    return workplace(WorkerSettings(data_dir=tmp_path, slots=3, worker_name="test"))


def rendered(place: Workplace, *, threads: int, **more: Any) -> tuple[dict[str, Any], str]:
    """Return the digests of a frame that is rendered by as many threads as an order allows, and its log."""
    spec = small_job("fish", count=(10, 10), render={"cache": False, **more.pop("render", {})}, **more)
    stored_job(place, spec)
    (tile,) = tiles_of(spec)
    order = order_of(TaskKind.RENDER, tile=tile).model_copy(update={"threads": threads})
    digests = {**render_tile(place, order, NullMonitor()).digests}
    log = place.store.get_bytes(names.job_artifact(JOB_ID, names.log_name(TaskKind.RENDER, 1, tile.index, None, 1)))
    return digests, log.decode()


@pytest.mark.parametrize("render", [{}, {"antialias": {}}])
def test_threads_change_no_pixel_of_glass(tmp_path: Path, render: dict[str, Any]) -> None:
    found = []
    for threads in (1, 3):
        place = workplace(WorkerSettings(data_dir=tmp_path / str(threads), slots=3, worker_name="test"))
        digests, log = rendered(place, threads=threads, capture={"method": "glass"}, render=render)
        assert f"+WT{threads}" in log
        found.append(digests)
    assert found[0] == found[1]


def test_an_order_gets_no_more_threads_than_the_worker_has_slots(place: Workplace) -> None:
    _, log = rendered(place, threads=500, capture={"method": "glass"})
    assert "+WT3" in log


def test_the_ray_camera_has_one_thread_since_its_rays_are_parsed_by_one(place: Workplace) -> None:
    _, log = rendered(place, threads=3)
    assert "+WT1" in log


@pytest.mark.parametrize(("capture", "expected"), [({"method": "glass"}, True), ({}, False)])
def test_the_probe_reports_whether_threads_are_of_use(
    place: Workplace, capture: dict[str, Any], *, expected: bool
) -> None:
    stored_job(place, small_job("fish", count=(4, 4), capture=capture))
    probe = probe_job(place, order_of(TaskKind.PROBE, frame=None), NullMonitor()).probe
    assert probe is not None
    assert probe.parallel is expected
