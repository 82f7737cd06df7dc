"""The frames that outputs are made from: the masters of a job in the store, or files.

Every output is made from the orthoscopic integral images. The other masters (the pseudoscopic capture, all views, the
image on the pixels of a device) follow from them by the functions that `worker.tasks.assemble` uses.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import ArtifactBroken, ArtifactMissing, OutputError
from lippmann.job.resolved import ResolvedJob
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
from worker.tasks.artifacts import TaskArtifacts


def _unknown(frame: int) -> None:
    """Return None, the stage of imported pictures."""


@dataclass(frozen=True)
class FrameSource:
    """Orthoscopic integral images in time, with their optics."""

    frames: tuple[int, ...]
    """The numbers of the frames, in rising order."""
    fps: float
    layout: CellLayout
    """The layout of every orthoscopic integral image."""
    rig: Callable[[int], Rig]
    """Returns the rig at a frame, with its keyframes resolved."""
    display: Display
    facts: Mapping[str, str]
    """The origin of the frames, for sidecars: job, scene, title."""
    master: Callable[[str], AbstractContextManager[Path]]
    """Opens a master by its name below the job, such as `names.orthoscopic_name(frame)`, or raises ArtifactMissing."""
    stage: Callable[[int], Stage | None] = _unknown
    """Returns the stage of the scene at a frame; None if it is unknown."""
    has_depth: bool = False
    """True if the depth of every pixel is known, see `depth`."""

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
        """Yield the orthoscopic integral image of a frame as a sheet of which only the requested rows are read."""
        name = names.orthoscopic_name(frame)
        with naming_frame(frame), self.master(name) as path, open_rows(path, dtype=np.float16) as rows:
            yield SheetOfRows(rows, self.layout)

    def depth(self, frame: int) -> DepthMap:
        """Read the depth map of the orthoscopic integral image of a frame.

        Raises
        ------
        OutputError
            If the job was captured without depth.
        ArtifactMissing, ArtifactBroken
            If the file is missing or incomplete.
        """
        if not self.has_depth:
            raise OutputError("expected a job with capture.depth, got one without")
        with naming_frame(frame), self.master(names.depth_name(frame)) as path:
            return DepthMap(read_channels(path, CHANNELS))

    def integral(self, frame: int) -> NDArray[np.float16]:
        """Return the pixels of a frame as captured, pseudoscopic, `(row, col, channel)`."""
        # The orthoscopic conversion is its own inverse.
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


def job_frames(artifacts: TaskArtifacts, sheet: ResolvedJob, *, skipped: Collection[int] = ()) -> FrameSource:
    """Return the frames of a job in the store, without those that are skipped."""
    spec = sheet.spec
    return FrameSource(
        frames=tuple(frame for frame in spec.frame_numbers if frame not in skipped),
        fps=spec.fps,
        layout=display_size(spec.rig),
        rig=lambda frame: sheet.at(frame).spec.rig,
        display=spec.display,
        facts={"job": sheet.job_id, "scene": spec.scene, "title": spec.title, "bundle": sheet.bundle},
        master=artifacts.opened,
        stage=_unknown if sheet.sheets is not None else lambda frame: sheet.at(frame).stage,
        has_depth=spec.capture.depth,
    )
