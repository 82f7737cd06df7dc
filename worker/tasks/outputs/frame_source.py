"""The frames that outputs are made from: the masters of a job in the store, or files.

Every output is made from the orthoscopic integral images. The other masters (the pseudoscopic capture, all views, the
image on the pixels of a device) follow from them by the functions that `worker.tasks.frames.assemble` uses.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import ArtifactBroken, ArtifactMissing, OutputError
from lippmann.job.optics.rig import Rig
from lippmann.job.rendering.channels import CHANNEL_PARTS, objects_in, stored_channels
from lippmann.job.rendering.render_settings import Channel
from lippmann.job.resolved import ResolvedJob
from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import Display
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.depth.depth_map import CHANNELS, DepthMap
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.sheet.bands import Rows, Sheet, SheetOfRows
from lippmann.lightfield.sheet.orthoscopic import orthoscopic
from lippmann.plan import artifact_names as names
from lippmann.plan.sampling import display_size
from worker.images.bands.rows import open_rows
from worker.images.read import read_attributes, read_channels, read_rgb
from worker.tasks.attempts.artifacts import TaskArtifacts


def _unknown(frame: int) -> None:
    """Return None, the stage of imported pictures."""


@dataclass(frozen=True)
class MasterReader:
    """Decodes the files of masters; each function raises ArtifactMissing or ArtifactBroken."""

    light: Callable[[Path], NDArray[np.float16]]
    """Returns the light of a master, `(rows, cols, 3)`."""
    rows: Callable[[Path], AbstractContextManager[Rows]]
    """Opens a master whose rows are read in half floats, in any order."""
    numbers: Callable[[Path, Sequence[str]], NDArray[np.float32]]
    """Returns channels by their names, `(rows, cols, channel)`."""


OWN_MASTERS = MasterReader(partial(read_rgb, dtype=np.float16), partial(open_rows, dtype=np.float16), read_channels)
"""The reader of masters that this farm has made, in the process of the worker."""


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
    channels: tuple[Channel, ...] = ()
    """The other channels that every frame has; see `channel`."""
    reader: MasterReader = OWN_MASTERS
    """Decodes the files that `master` opens; those of others are decoded in the sandbox."""

    def image(self, frame: int) -> IntegralImage:
        """Read the orthoscopic integral image of a frame, in half floats."""
        array = self.rig(frame).lens_array
        with naming_frame(frame), self.master(names.orthoscopic_name(frame)) as path:
            return IntegralImage(
                pixels=self.reader.light(path),
                layout=self.layout,
                pitch_mm=array.pitch_mm,
                focal_length_mm=array.focal_length_mm,
            )

    @contextmanager
    def orthoscopic_rows(self, frame: int) -> Iterator[Sheet]:
        """Yield the orthoscopic integral image of a frame as a sheet of which only the requested rows are read."""
        name = names.orthoscopic_name(frame)
        with naming_frame(frame), self.master(name) as path, self.reader.rows(path) as rows:
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
            return DepthMap(self.reader.numbers(path, CHANNELS))

    def channel(self, frame: int, channel: Channel) -> NDArray[np.float32]:
        """Read a channel of the orthoscopic integral image of a frame, `(row, col, number)`; see `job.channels`.

        Raises
        ------
        OutputError
            If the job was captured without it.
        ArtifactMissing, ArtifactBroken
            If the file is missing or incomplete.
        """
        if channel not in self.channels:
            raise OutputError(f"expected a job with {channel} in capture.channels, got one without")
        with naming_frame(frame), self.master(names.channels_name(frame)) as path:
            return self.reader.numbers(path, CHANNEL_PARTS[channel])

    def objects(self, frame: int) -> tuple[str, ...]:
        """Return the names of the objects of a frame from number 1; none without the channel `object`.

        Raises
        ------
        ArtifactMissing, ArtifactBroken
            If the file is missing or its header is damaged.
        """
        if "object" not in self.channels:
            return ()
        with naming_frame(frame), self.master(names.channels_name(frame)) as path:
            return objects_in(read_attributes(path))

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
        channels=stored_channels(spec.capture),
    )
