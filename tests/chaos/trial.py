"""One trial: a farm, a job that renders, one fault, and the examination of everything that is left afterwards."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Iterable
from contextlib import AbstractContextManager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from random import Random

import numpy as np
from numpy.typing import NDArray

from lippmann.plan import artifact_names as names
from service.schemas.job import Job
from tests.chaos.kinds import Kind, Work
from tests.chaos.parts import Parts, separate_parts
from tests.chaos.seven_hosts import seven_hosts
from tests.farm import LIPPMANN, ended
from tests.waiting import until
from tests.without_farm import masters_without_farm
from worker.images.read import read_rgb

JOB_S = 7200.0
"""A limit for a job of half a minute with a fault of a minute in it, and for one of a thousand frames."""

NOT_OF_THE_FAULT = ("space", "broker")
"""The checks of `lippmann doctor` whose findings are those of the machine, and of brokers that keep no data."""

Pixels = dict[int, str]
"""The digest of the pixels of each frame."""


@dataclass
class Verdict:
    """What a trial found; `wrong` is empty if everything is right."""

    kind: str
    seed: int
    wrong: list[str] = field(default_factory=list)
    seconds: float = 0.0
    """The time from submission to the end of the job."""
    attempts_again: int = 0
    """The number of attempts beyond one a task."""
    recovered_s: float | None = None
    """The time until nothing was with a lost worker, if the kind measures it."""

    def json(self) -> str:
        return json.dumps(asdict(self))


def undisturbed(work: Work, folder: Path) -> Pixels:
    """Return the pixels of the compared frames without a farm."""
    folder.mkdir(parents=True)
    masters = masters_without_farm(folder, work.spec(f"1-{work.frames}:{work.compared}"))
    return {frame: _digest(master) for frame, master in masters.items()}


def go_through(kind: Kind, seed: int, right: Pixels, folder: Path) -> Verdict:
    """Inject a fault once and examine the farm; its data and logs stay in the folder."""
    rng, verdict = Random(f"{kind.name} {seed}"), Verdict(kind.name, seed)
    folder.mkdir(parents=True)
    try:
        with _opened(kind, folder) as parts:
            begun_s = time.monotonic()
            job_id = parts.client.submit(kind.work.spec(f"1-{kind.work.frames}")).id
            until(lambda: parts.client.job(job_id).tasks.running == len(parts.workers), within_s=JOB_S, every_s=0.1)
            time.sleep(rng.uniform(0.0, 4.0))  # faults come at any moment
            verdict.recovered_s = kind.inject(parts, job_id, rng)
            parts.heal()
            job = ended(parts.client, job_id, within_s=JOB_S)
            verdict.seconds = round(time.monotonic() - begun_s, 1)
            if kind.damages:
                parts.client.repair(job_id)
                until(lambda: parts.client.job(job_id).status == "done", within_s=JOB_S, every_s=0.1)
            verdict.wrong += _too_late(kind, verdict.recovered_s) + wrong_with(parts, job, kind.work, right)
            verdict.attempts_again = sum(task.attempt_number - 1 for task in parts.client.tasks(job_id))
    except Exception as error:  # a trial that breaks is a verdict, and the next one follows
        verdict.wrong.append(f"{type(error).__name__}: {error}"[:500])
    verdict.wrong += [f"left behind: {line}" for line in _left_behind(folder)]
    return verdict


def _opened(kind: Kind, folder: Path) -> AbstractContextManager[Parts]:
    if kind.seven:
        return seven_hosts(folder)
    return separate_parts(folder, keeps_data=kind.keeps_data, hosts=kind.hosts)


def _too_late(kind: Kind, recovered_s: float | None) -> list[str]:
    limit_s = kind.recovers_within_s
    if recovered_s is None or limit_s is None or recovered_s <= limit_s:
        return []
    return [f"tasks were with a lost worker for {recovered_s:.0f} s instead of {limit_s:.0f} s"]


def wrong_with(parts: Parts, job: Job, work: Work, right: Pixels) -> list[str]:
    """Return what is wrong with a job that has ended and with its farm."""
    if job.status != "done":
        return [f"the job ended as {job.status}: {job.error}"]
    tasks = list(parts.client.tasks(job.id))
    found = [f"task {task.id} is {task.status}" for task in tasks if task.status != "done"]
    if job.frames_done != work.frames:
        found.append(f"{job.frames_done} of {work.frames} frames are done")
    expected = {"probe": 1, "render": work.tiles * work.frames, "assemble": work.frames}
    for name, number in expected.items():
        if (there := sum(task.kind == name for task in tasks)) != number:
            found.append(f"{there} tasks of the kind {name} instead of {number}")
    pixels = _pixels(parts, job, right)
    found += [f"frame {frame} has other pixels" for frame in right if pixels[frame] != right[frame]]
    with suppress(AssertionError):  # what follows says what stays
        until(lambda: not _pending(parts), within_s=90.0, every_s=0.1)
    found += _pending(parts)
    until(lambda: len(parts.client.workers().items) == len(parts.workers), within_s=JOB_S, every_s=0.1)
    return found + _doctor(parts)


def _pixels(parts: Parts, job: Job, frames: Iterable[int]) -> Pixels:
    found = {}
    with tempfile.TemporaryDirectory(dir=parts.folder) as folder:
        for frame in frames:
            path = Path(folder, f"{frame}.exr")
            parts.client.download(job.id, names.orthoscopic_name(frame), path)
            found[frame] = _digest(read_rgb(path, np.float16))
    return found


def _digest(picture: NDArray[np.float16]) -> str:
    return hashlib.sha256(np.ascontiguousarray(picture).tobytes()).hexdigest()


def _pending(parts: Parts) -> list[str]:
    """Return what a farm without open jobs still does or keeps."""
    busy = [f"{part.name} runs povray" for part in parts.workers if part.below("povray")]
    busy += [f"{part.name} runs Mitsuba" for part in parts.workers if part.mitsuba()]
    scratch = parts.folder.glob("*/scratch/attempts/*")
    orders = parts.redis.llen("lippmann:celery:lippmann")
    return busy + [f"scratch stays: {path.name}" for path in scratch] + ([f"{orders} orders wait"] if orders else [])


def _doctor(parts: Parts) -> list[str]:
    command = [LIPPMANN, "doctor", "--deep", "--json", "--data-dir", str(parts.data_dir)]
    ran = subprocess.run(command, env=parts.service.env, capture_output=True, text=True)
    if not ran.stdout:
        return [f"doctor: {ran.stderr.strip()}"]
    bad = [one for one in json.loads(ran.stdout)["findings"] if one["level"] in ("warning", "error")]
    return [f"doctor: {one['check']}: {one['message']}" for one in bad if one["check"] not in NOT_OF_THE_FAULT]


def _left_behind(folder: Path) -> list[str]:
    """Return the processes of a farm that live although it has ended."""
    mark = b"LIPPMANN_DATA_DIR=" + os.fsencode(folder) + b"/"
    found = []
    for process in Path("/proc").iterdir():
        with suppress(OSError):
            if process.name.isdigit() and mark in (process / "environ").read_bytes():
                found.append((process / "cmdline").read_bytes().replace(b"\0", b" ").decode("utf-8", "replace")[:120])
    return found
