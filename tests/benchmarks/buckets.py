"""The cost of a bucket against a disk, for the paper's video."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path

from lippmann.client.fetch import fetch_job
from lippmann.farm.demo import demo_job
from tests.benchmarks.farm import ROUNDS, SLOTS
from tests.farm import Farm, farm_up
from tests.object_store import running_object_store
from tests.waiting import until

JOB = demo_job("1-12") | {"render": {"cache": False}}


def video_ratio(folder: Path) -> str:
    """Return the wall time of the video and of fetching its masters, on a bucket on loopback against a disk.

    The S3 server runs on the cores that render.
    """
    video_s: dict[str, list[float]] = {"bucket": [], "disk": []}
    fetch_s: dict[str, list[float]] = {"bucket": [], "disk": []}
    with ExitStack() as stack:
        server = stack.enter_context(running_object_store())
        bucket = {"LIPPMANN_STORE_URL": f"s3://{server.new_bucket()}/farm", "LIPPMANN_S3_ENDPOINT": server.endpoint}
        farms = {
            name: stack.enter_context(farm_up(folder / name, slots=SLOTS, env=env))
            for name, env in (("bucket", bucket), ("disk", {}))
        }
        until(lambda: all(farm.client.health().slots == SLOTS for farm in farms.values()))
        for number in range(ROUNDS):
            for name, farm in farms.items():
                job_id, taken_s = _made(farm)
                video_s[name].append(taken_s)
                started_s = time.monotonic()
                fetch_job(farm.client, job_id, folder / f"{name}-{number}", masters=True)
                fetch_s[name].append(time.monotonic() - started_s)
    return f"{_ratio(video_s)}; fetch {_ratio(fetch_s)}"


def _made(farm: Farm) -> tuple[str, float]:
    """Return a job that was done, and the seconds that it took."""
    started_s = time.monotonic()
    job_id = farm.client.submit(JOB).id
    *_, job = farm.client.follow(job_id)
    assert job.status == "done", job.error
    return job_id, time.monotonic() - started_s


def _ratio(taken_s: dict[str, list[float]]) -> str:
    bucket_s, disk_s = min(taken_s["bucket"]), min(taken_s["disk"])
    return f"{bucket_s / disk_s:.2f} ({bucket_s:.1f} / {disk_s:.1f} s)"
