"""Previews without a farm, by the same steps that a worker takes; the scene stays loaded for the next one."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from lippmann.job.messages.previews import PreviewMade
from lippmann.job.spec import JobSpec
from lippmann.optics.rig.check import check_rig
from lippmann.plan.preview import PreviewRig, PreviewSize, preview_job, rig_numbers
from worker.engines.choose import ENGINES
from worker.sandbox.limits import TimeLimit
from worker.settings import WorkerSettings
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace, workplace
from worker.tasks.local import local_job
from worker.tasks.previews.camera import KnownCameras
from worker.tasks.previews.picture import render_preview


@dataclass(frozen=True)
class LocalPreview:
    """A preview with the numbers of its rig."""

    made: PreviewMade
    rig: PreviewRig
    notes: tuple[str, ...]
    """The differences of the preview from the job."""


class LocalPreviews:
    """Renders previews in a workplace of this machine, one after the other."""

    def __init__(self, place: Workplace) -> None:
        self._place = place
        self._cameras = KnownCameras()

    def render(self, spec: JobSpec, bundle: bytes, *, frame: int | None, size: PreviewSize) -> LocalPreview:
        """Render a small frame of a job, by default its first one.

        Raises
        ------
        LippmannError
            Whatever a preview on the farm would fail with.
        """
        number = frame or spec.frame_numbers[0]
        sheet = local_job(self._place, spec, bundle, frames=max(number, spec.frame_numbers[-1]))
        smaller = preview_job(sheet, frame=number, size=size)
        there = sheet.at(number)
        check_rig(there.spec, there.stage)
        limit = TimeLimit(spec.render.timeout_s, "render.timeout_s of the job")
        made = render_preview(
            self._place, smaller.job, number, limit=limit, cameras=self._cameras, monitor=NullMonitor()
        )
        return LocalPreview(made, rig_numbers(smaller.job.spec.rig), smaller.notes)


@contextmanager
def local_previews(settings: WorkerSettings) -> Iterator[LocalPreviews]:
    """Yield what renders previews; engines and files are gone afterwards."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="lippmann-preview-"))
        for engine in ENGINES.values():
            stack.callback(engine.end)  # before the folders of the store go
        yield LocalPreviews(workplace(settings.model_copy(update={"data_dir": Path(folder)}), own_files=True))
