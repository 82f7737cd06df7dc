"""A farm in which one worker has Mitsuba and one has not."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lippmann.job.messages.orders import TaskKind
from lippmann.job.outputs.videos import CentreVideo
from lippmann.plan import artifact_names as names
from tests.builders import small_job
from tests.chaos.parts import separate_parts
from tests.farm import ended
from tests.needs import missing
from tests.without_farm import masters_without_farm
from worker.engines.mitsuba.version import Missing, mitsuba_version
from worker.images.read import read_rgb


def test_a_job_of_mitsuba_is_rendered_where_mitsuba_is_with_the_pixels_of_this_machine(tmp_path: Path) -> None:
    found = mitsuba_version()
    if isinstance(found, Missing):
        missing(f"needs Mitsuba: {found.reason}")
    spec = small_job("fish-mesh", count=(12, 10), tiles=[2, 1], frames="1-2")
    spec = spec.model_copy(update={"outputs": (CentreVideo(),)})
    with separate_parts(tmp_path, of_workers=[{"LIPPMANN_MITSUBA": "auto"}, {"LIPPMANN_MITSUBA": "off"}]) as parts:
        engines = {worker.name: worker.engine_versions for worker in parts.client.workers().items}
        assert engines["worker0"]["mitsuba"] == f"{found.version} {found.variant}"
        assert set(engines["worker1"]) == {"povray"}
        job = ended(parts.client, parts.client.submit(spec).id)
        assert job.status == "done", job.error
        tasks = list(parts.client.tasks(job.id))
        needing = [task for task in tasks if task.kind in (TaskKind.PROBE, TaskKind.RENDER)]
        assert len(needing) == 1 + 2 * 2
        assert {task.worker for task in needing} == {"worker0"}
        for frame, pixels in masters_without_farm(tmp_path / "here", spec).items():
            path = parts.data_dir / "artifacts" / names.job_artifact(job.id, names.orthoscopic_name(frame))
            np.testing.assert_array_equal(read_rgb(path, np.float16), pixels)
