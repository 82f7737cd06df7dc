"""The farm against plain POV-Ray, on the same frames and the same .pov."""

from __future__ import annotations

import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from lippmann.job.messages.orders import TileIndex
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.plan import artifact_names as names
from povtemplates.catalogue import INCLUDE_FOLDER, scene_folders
from service.schemas.job import Job
from tests.farm import Farm, ended, farm_up

FRAMES = "1-8"
SLOTS = 2
ROUNDS = 2
"""Each road is taken so often, in turn, and its best time counts: what it can do, not what else ran meanwhile."""


def spec_of(frames: str) -> JobSpec:
    """Return the paper's job as glass, which plain povray can render too, and without videos."""
    uncached = {"render": {"cache": False}}
    return parse_spec({"scene": "fish", "frames": frames, "outputs": [], "capture": {"method": "glass"}, **uncached})


def wall_ratio(folder: Path) -> str:
    """Return wall time of the farm, from submission to the last frame assembled, against plain povray."""
    spec = spec_of(FRAMES)
    farm_s, plain_s = [], []
    with farm_up(folder / "data", slots=SLOTS) as farm:
        for number in range(ROUNDS):
            started_s = time.monotonic()
            job = ended(farm.client, farm.client.submit(spec).id, within_s=600)
            farm_s.append(time.monotonic() - started_s)
            plain_s.append(plain_povray_s(farm, job, spec, folder / f"plain-{number}"))
    return f"{min(farm_s) / min(plain_s):.3f} ({min(farm_s):.1f} / {min(plain_s):.1f} s)"


def plain_povray_s(farm: Farm, job: Job, spec: JobSpec, folder: Path) -> float:
    """Return the wall time of the same frames by plain povray, `SLOTS` processes at a time."""
    folder.mkdir()
    text = farm.data_dir / "artifacts" / names.job_artifact(job.id, names.pov_name(1, TileIndex(row=0, col=0)))

    def render(frame: int) -> None:
        subprocess.run(
            [
                *("povray", f"+I{text}", f"+O{folder}/{frame}.exr", "+FE", "+W720", "+H720"),
                *("-D", "-A", "+WT1", f"+K{frame - 1}", f"+L{scene_folders()['fish']}", f"+L{INCLUDE_FOLDER}"),
            ],
            check=True,
            capture_output=True,
        )

    started_s = time.monotonic()
    with ThreadPoolExecutor(SLOTS) as pool:
        list(pool.map(render, spec.frame_numbers))
    return time.monotonic() - started_s


def assemble_share(folder: Path) -> str:
    """Return the CPU seconds of assembling against those of rendering, over a job."""
    with farm_up(folder / "data", slots=SLOTS) as farm:
        job = ended(farm.client, farm.client.submit(spec_of("1-4")).id, within_s=600)
        tasks = list(farm.client.tasks(job.id))
    cpu_s = {kind: sum(task.cpu_s or 0.0 for task in tasks if task.kind == kind) for kind in ("render", "assemble")}
    return f"{100 * cpu_s['assemble'] / cpu_s['render']:.1f} %"
