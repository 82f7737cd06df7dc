"""The program of Mitsuba fails while it renders: the job ends right, with the pixels of an undisturbed run.

`make chaos ARGS=mitsuba` tries each fault in a farm of its own.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lippmann.plan import artifact_names as names
from tests.chaos.kinds import mitsuba
from tests.chaos.parts import mitsuba_below
from tests.chaos.test_kill import QUICK
from tests.farm import ended, farm_up
from tests.needs import missing
from tests.waiting import until
from tests.without_farm import masters_without_farm
from worker.engines.mitsuba.version import Missing, mitsuba_version
from worker.images.read import read_rgb

STALL_S = 45.0
"""The time without progress after which the worker ends the program; more than a start on a busy machine takes."""
ENV = {**QUICK, "LIPPMANN_MITSUBA": "auto", "LIPPMANN_FAILURES_ALLOWED": "9", "LIPPMANN_RETRY_PAUSE_S": "0"}


def test_a_program_that_is_killed_that_starves_and_that_stands_still_costs_time_and_nothing_else(
    tmp_path: Path,
) -> None:
    found = mitsuba_version()
    if isinstance(found, Missing):
        missing(f"needs Mitsuba: {found.reason}")
    work = replace(mitsuba.MESHES, lenses=16, samples=4, stall_s=None)
    undisturbed = masters_without_farm(tmp_path / "undisturbed", work.spec("1"))
    with farm_up(tmp_path / "data", slots=1, env=ENV) as farm:
        job = farm.client.submit(replace(work, stall_s=STALL_S).spec("1"))
        (worker,) = until(lambda: farm.client.workers().items)
        hit = []
        for fault in (mitsuba.kill, mitsuba.starve, mitsuba.halt):
            pid = mitsuba.hit(worker.pid, fault)
            until(lambda pid=pid: pid not in mitsuba_below(worker.pid))
            hit.append(pid)
        job = ended(farm.client, job.id)
        assert job.status == "done", job.error
        assert len(set(hit)) == 3
        assert sum(task.attempt_number - 1 for task in farm.client.tasks(job.id)) >= 3
        for frame, pixels in undisturbed.items():
            path = farm.data_dir / "artifacts" / names.job_artifact(job.id, names.orthoscopic_name(frame))
            np.testing.assert_array_equal(read_rgb(path, np.float16), pixels)
    assert not list((tmp_path / "data/scratch/attempts").iterdir())
