"""What outputs are made of: the frames of a job, or of files from elsewhere.

Everything is made from the orthoscopic sheets. What else there is (the capture as it was, all views, the sheet on a
device's pixels) follows from them by the same functions that `worker.tasks.assemble` uses.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import ArtifactBroken, ArtifactMissing, OutputError
from lippmann.job.resolved import JobSheet
from lippmann.job.rig import Rig
from lippmann.job.spec import Display
from lippmann.job.stage import Stage
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import CHANNELS, DepthMap
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.sheet.bands import Sheet, SheetOfRows
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from worker.images.read import read_channels, read_rgb
from worker.images.rows import open_rows
from worker.tasks.workplace import Workplace


def _unknown(frame: int) -> None:
    """Return the stage of a picture from elsewhere."""


@dataclass(frozen=True)
class Footage:
    """Orthoscopic integral images in time, and what is known of them."""

    frames: tuple[int, ...]
    """Their numbers, rising."""
    fps: float
    layout: CellLayout
    """Of every orthoscopic sheet."""
    rig: Callable[[int], Rig]
    """The rig at a frame, without keyframes."""
    display: Display
    facts: Mapping[str, str]
    """What a sidecar says of where this comes from: job, scene, title."""
    master: Callable[[str], AbstractContextManager[Path]]
    """Lends a master by its name below the job, as `names.orthoscopic_name(frame)`; ArtifactMissing if not there."""
    stage: Callable[[int], Stage | None] = _unknown
    """The scene's stage at a frame; None if nobody knows it."""
    has_depth: bool = False
    """Whether the depth of every pixel is known, see `depth`."""

    def image(self, frame: int) -> IntegralImage:
        """Read the orthoscopic integral image of a frame, in half floats."""
        array = self.rig(frame).lens_array
        with naming_frame(frame), self.master(names.orthoscopic_name(frame)) as path:
            return IntegralImage(
                pixels=read_rgb(path, np.float16),
                layout=self.layout,
                pitch_mm=array.pitch_mm,
                focal_length_mm=array.focal_length_mm,
            )

    @contextmanager
    def orthoscopic_rows(self, frame: int) -> Iterator[Sheet]:
        """Lend a frame's orthoscopic sheet, of which no more is read than what is asked for."""
        name = names.orthoscopic_name(frame)
        with naming_frame(frame), self.master(name) as path, open_rows(path, dtype=np.float16) as rows:
            yield SheetOfRows(rows, self.layout)

    def depth(self, frame: int) -> DepthMap:
        """Return how deep what every pixel of a frame's orthoscopic sheet shows lies.

        Raises
        ------
        OutputError
            If the job did not ask for it.
        ArtifactMissing, ArtifactBroken
            If it did, and it is gone meanwhile, or not whole.
        """
        if not self.has_depth:
            raise OutputError("expected a job with capture.depth, got one without")
        with naming_frame(frame), self.master(names.depth_name(frame)) as path:
            return DepthMap(read_channels(path, CHANNELS))

    def integral(self, frame: int) -> NDArray[np.float16]:
        """Return a frame as it was captured, pseudoscopic."""
        # What makes a capture orthoscopic is its own inverse.
        inverted = self.rig(frame).imaging_lens is not None
        return orthoscopic(self.image(frame).pixels, self.layout, inverted=inverted)


@contextmanager
def naming_frame(frame: int) -> Iterator[None]:
    """Add the number of a frame to the errors of reading its masters, from which the service repairs the frame."""
    try:
        yield
    except (ArtifactBroken, ArtifactMissing) as error:
        if error.frame is None:
            error.frame = frame
        raise


def job_footage(place: Workplace, sheet: JobSheet) -> Footage:
    """Return the footage of a job in the store."""
    spec = sheet.spec
    return Footage(
        frames=spec.frame_numbers,
        fps=spec.fps,
        layout=display_size(spec.rig),
        rig=lambda frame: sheet.at(frame).spec.rig,
        display=spec.display,
        facts={"job": sheet.job_id, "scene": spec.scene, "title": spec.title, "bundle": sheet.bundle},
        master=lambda name: place.store.local_path(names.job_artifact(sheet.job_id, name)),
        stage=lambda frame: sheet.at(frame).stage,
        has_depth=spec.capture.depth,
    )
