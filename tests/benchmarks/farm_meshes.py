"""The farm against a loop around Mitsuba, on the frames of the paper's video in meshes, with the same rays."""

from __future__ import annotations

import resource
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.scene import parse_scene
from lippmann.job.spec import parse_spec
from lippmann.untrusted.toml_text import read_toml
from povtemplates.catalogue import MANIFEST
from tests.benchmarks.engines import SCENE, serve
from tests.benchmarks.farm import SLOTS
from tests.farm import farm_up, wait_for_slots
from worker.engines.mitsuba.inside.messages import Request

ROUNDS = 2
"""Each road is taken so often, in turn, and its best time counts."""
JOB = {"scene": "fish-mesh", "frames": "1-45", "outputs": [], "render": {"cache": False}}


def video_ratio(folder: Path) -> str:
    """Return wall time of the farm up to the last assembled frame, and CPU of its tasks, both against the loop.

    On a machine that does other work, a farm with its many processes gets a larger share of it than the loop.
    """
    spec, farm_s, loop_s, ratios = parse_spec(JOB), [], [], []
    with farm_up(folder / "data", slots=SLOTS, env={"LIPPMANN_MITSUBA": "auto"}) as farm:
        wait_for_slots(farm.client, SLOTS)
        for number in range(ROUNDS):
            started_s = time.monotonic()
            *_, job = farm.client.follow(farm.client.submit(spec).id)
            assert job.status == "done", job.error
            farm_s.append(time.monotonic() - started_s)
            cpu_s = sum(task.cpu_s or 0.0 for task in farm.client.tasks(job.id))
            before_s = _children_cpu_s()
            loop_s.append(_loop_s(folder / f"loop-{number}"))
            ratios.append(cpu_s / (_children_cpu_s() - before_s))
    return f"{min(farm_s) / min(loop_s):.2f} ({min(farm_s):.1f} / {min(loop_s):.1f} s), {min(ratios):.2f}"


def _children_cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _loop_s(folder: Path) -> float:
    """Return the wall time of a loop over the frames in as many processes as the farm has slots."""
    spec = parse_spec(JOB)
    manifest = parse_scene(read_toml((SCENE / MANIFEST).read_bytes(), field=MANIFEST))
    job, layout = ResolvedJob.of("bench", spec, manifest, bundle="fish-mesh"), spec.rig.layout
    requests = [
        Request(
            number=1, job=job.at(frame), frame=frame, rows=layout.rows, cols=layout.cols,
            region=(0, layout.rows, 0, layout.cols), bundle=str(SCENE), out=str(frame),
        )
        for frame in spec.frame_numbers
    ]  # fmt: skip
    folder.mkdir()
    started_s = time.monotonic()
    with ThreadPoolExecutor(SLOTS) as pool:
        list(pool.map(lambda first: serve(requests[first::SLOTS], folder), range(SLOTS)))
    return time.monotonic() - started_s
