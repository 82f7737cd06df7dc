"""A job whose masters are given, without POV-Ray, and its outputs as a worker makes them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.messages.orders import TaskKind
from lippmann.job.outputs.choice import output_called
from lippmann.job.resolved import ResolvedJob
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.views.views import views_grid
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from tests.builders import artifacts_of, local_place, order_of, small_job, stored_job, stored_picture
from worker.images.write import write_exr
from worker.tasks.attempts.artifacts import TaskArtifacts
from worker.tasks.attempts.monitor import NullMonitor, ProgressMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.encode import encode_output
from worker.tasks.frames.render import header
from worker.tasks.local import JOB_ID


@dataclass(frozen=True)
class GivenJob:
    """A stored job with orthoscopic masters, and the grids of their views."""

    place: Workplace
    sheet: ResolvedJob

    @property
    def artifacts(self) -> TaskArtifacts:
        """The artifacts of the job, without expected digests."""
        return artifacts_of(self.place)

    @property
    def layout(self) -> CellLayout:
        """Of the orthoscopic sheets."""
        return display_size(self.sheet.spec.rig)

    def stored_sheet(self, frame: int) -> NDArray[np.float16]:
        """Return a frame's orthoscopic sheet as it is stored."""
        return stored_picture(self.place, names.orthoscopic_name(frame))

    def make(self, file_name: str, monitor: ProgressMonitor | None = None) -> None:
        """Make an output as an attempt on the farm does."""
        encode_output(self.place, order_of(TaskKind.ENCODE, frame=None, output=file_name), monitor or NullMonitor())

    def remove(self, file_name: str) -> None:
        """Remove a video, so that it is made again."""
        self.place.store.delete(names.job_artifact(JOB_ID, f"video/{file_name}"))

    def file(self, name: str) -> AbstractContextManager[Path]:
        """Lend a file of the job by its name."""
        return self.place.store.local_path(names.job_artifact(JOB_ID, name))

    def sidecar(self, file_name: str) -> dict[str, Any]:
        """Return what is told beside an output."""
        name = names.sidecar_name(output_called(self.sheet.spec.outputs, file_name))
        return dict(json.loads(self.place.store.get_bytes(names.job_artifact(JOB_ID, name))))


def given_job(folder: Path, sheets: Mapping[int, NDArray[np.floating[Any]]] | None = None, **more: Any) -> GivenJob:
    """Return a job with these orthoscopic sheets, linear light, by frame; of noise where none are given.

    `more` is as in `small_job`; the scene is the white target, or `scene`.
    """
    place = local_place(folder)
    spec = small_job(more.pop("scene", "target-white"), **{"count": (6, 5), "px_per_lens": 4, **more})
    job = GivenJob(place, stored_job(place, spec))
    noise = np.random.default_rng(1)
    for frame in spec.frame_numbers:
        layout = job.layout
        sheet = sheets[frame] if sheets else noise.random((layout.rows, layout.cols, 3), dtype=np.float32)
        for name, picture in (
            (names.orthoscopic_name(frame), sheet),
            (names.views_name(frame), views_grid(np.asarray(sheet), layout)),
        ):
            write_exr(folder / "given.exr", picture, attributes=header(job.sheet, frame))
            place.store.put_file(names.job_artifact(JOB_ID, name), folder / "given.exr")
    return job
