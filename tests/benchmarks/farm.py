"""The farm against plain POV-Ray, on the same frames and the same .pov."""

from __future__ import annotations

import subprocess
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from lippmann.job.messages.orders import TileIndex
from lippmann.job.spec import JobSpec, parse_spec
from lippmann.plan import artifact_names as names
from povtemplates.catalogue import INCLUDE_FOLDER, scene_folders
from service.schemas.job import Job
from tests.farm import Farm, ended, farm_up, wait_for_slots

SLOTS = 2
ROUNDS = 2
"""Each road is taken so often, in turn, and its best time counts: what it can do, not what else ran meanwhile."""


@dataclass(frozen=True)
class Work:
    """Frames that the farm and plain povray render, each with as many cores as the farm has slots."""

    frames: str
    lenses: int = 90
    """The lenses of a row and of a column, of 8 x 8 px each."""
    threads: int = 1
    """The threads of a plain povray; as many processes run at once as there are slots for them."""

    @property
    def spec(self) -> JobSpec:
        """The paper's job as glass, which plain povray can render too, and without videos."""
        job = {"scene": "fish", "frames": self.frames, "outputs": [], "capture": {"method": "glass"}}
        rig = {"lens_array": {"count": [self.lenses, self.lenses]}}
        return parse_spec({**job, "rig": rig, "render": {"cache": False}})

    @property
    def px(self) -> int:
        """The pixels of a row and of a column."""
        return 8 * self.lenses


FRAMES = Work("1-12")
SHORT_FRAMES = Work("1-90", lenses=25)
"""Frames of about half a second."""
STILL = Work("1", lenses=300, threads=SLOTS)


def frames_ratio(folder: Path) -> str:
    """Return wall time of the farm, from submission to the last frame assembled, against plain povray."""
    return _wall_ratio(folder, FRAMES)


def short_frames_ratio(folder: Path) -> str:
    """Return the same of many short frames, most of whose time is the start and the end of POV-Ray."""
    return _wall_ratio(folder, SHORT_FRAMES)


def still_ratio(folder: Path) -> str:
    """Return the same of one large frame, which the farm cuts into tiles, against one povray with as many threads."""
    return _wall_ratio(folder, STILL)


def _wall_ratio(folder: Path, work: Work) -> str:
    farm_s, plain_s = [], []
    with farm_up(folder / "data", slots=SLOTS) as farm:
        wait_for_slots(farm.client, SLOTS)
        for number in range(ROUNDS):
            started_s = time.monotonic()
            # Followed as `submit --watch` does it: who asks ten times a second takes a tenth of a core.
            *_, job = farm.client.follow(farm.client.submit(work.spec).id)
            assert job.status == "done", job.error
            farm_s.append(time.monotonic() - started_s)
            plain_s.append(plain_povray_s(farm, job, work, folder / f"plain-{number}"))
    return f"{min(farm_s) / min(plain_s):.3f} ({min(farm_s):.1f} / {min(plain_s):.1f} s)"


def plain_povray_s(farm: Farm, job: Job, work: Work, folder: Path) -> float:
    """Return the wall time of the same frames by plain povray."""
    folder.mkdir()
    text = farm.data_dir / "artifacts" / names.job_artifact(job.id, names.pov_name(1, TileIndex(row=0, col=0)))

    def render(frame: int) -> None:
        subprocess.run(
            [
                *("povray", f"+I{text}", f"+O{folder}/{frame}.exr", "+FE", f"+W{work.px}", f"+H{work.px}"),
                *("-D", "-A", f"+WT{work.threads}", f"+K{frame - 1}"),
                *(f"+L{scene_folders()['fish']}", f"+L{INCLUDE_FOLDER}"),
            ],
            check=True,
            capture_output=True,
        )

    started_s = time.monotonic()
    with ThreadPoolExecutor(SLOTS // work.threads) as pool:
        list(pool.map(render, work.spec.frame_numbers))
    return time.monotonic() - started_s


def idle_share(folder: Path) -> str:
    """Return the share of the time of the slots, from the first render to the last, in which they have no task."""
    with farm_up(folder / "data", slots=SLOTS) as farm:
        job = ended(farm.client, farm.client.submit(FRAMES.spec).id, within_s=3600)
        held = [
            (task.started_at.timestamp(), task.ended_at.timestamp())
            for task in farm.client.tasks(job.id)
            if task.kind != "probe" and task.started_at is not None and task.ended_at is not None
        ]
    # The last slot to end has no task after it, so the time after the end of the first slot is not counted.
    begin, end = min(start for start, _ in held), sorted(stop for _, stop in held)[-SLOTS]
    busy_s = sum(max(0.0, min(stop, end) - start) for start, stop in held)
    return f"{100 * (1 - busy_s / (SLOTS * (end - begin))):.1f} %"


def assemble_share(folder: Path) -> str:
    """Return the CPU seconds of assembling against those of rendering, over a job."""
    with farm_up(folder / "data", slots=SLOTS) as farm:
        job = ended(farm.client, farm.client.submit(Work("1-4").spec).id, within_s=600)
        tasks = list(farm.client.tasks(job.id))
    cpu_s = {kind: sum(task.cpu_s or 0.0 for task in tasks if task.kind == kind) for kind in ("render", "assemble")}
    return f"{100 * cpu_s['assemble'] / cpu_s['render']:.1f} %"
