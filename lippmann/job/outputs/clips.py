"""Videos with a motion of their own: of the eye, of the focus."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.frames import format_frames
from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.outputs.videos import Fps, ShownVideo
from lippmann.job.problems import Misfit
from lippmann.job.rig import LensArray, Rig

DepthMm = Annotated[float, Field(ge=-1e6, le=1e6)]


class ClipOptions(OutputOptions):
    """How long a clip is, and whether the scene moves meanwhile."""

    fps: Fps = 24.0
    """Pictures a second; the scene keeps its own speed."""
    seconds: float | None = Field(default=None, gt=0, le=3600)
    """How long; when not given four seconds a period, and then to the end of the sequence."""
    periods: int = Field(default=1, ge=1, le=1000)
    """How often the motion goes there and back; whole, so that the clip has no seam."""
    frame: int | None = Field(default=None, ge=1)
    """Holds this one of the job's frames; else time runs, from the first frame again after the last one."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a frame that the job does not have."""
        super().check(rig, frames)
        if self.frame is not None and self.frame not in frames:
            raise Misfit("frame", expected=f"one of the job's frames, {format_frames(frames)}", got=self.frame)


@output_kind
class SweepVideo(ClipOptions, ShownVideo):
    """The eye swings before the display."""

    kind: Literal["sweep"] = "sweep"
    name: Name = "sweep"
    path: Literal["horizontal", "vertical", "circle"] = "horizontal"
    extent: float = Field(default=0.9, gt=0, le=1)
    """Of the way from the middle to where a lens shows its outermost pixel: 1 goes from the first view to the last."""
    distance_mm: float | None = Field(default=None, gt=0, le=1e6)
    """Of the eye; when not given endless: views as they are, and between them."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse an eye so near that it nowhere sees all lenses."""
        super().check(rig, frames)
        least_mm = least_sweep_mm(rig.lens_array, rig.px_per_lens)
        if self.distance_mm is not None and self.distance_mm < least_mm:
            expected = f"at least {least_mm:.6g} mm, where an eye sees light of all lenses"
            raise Misfit("distance_mm", expected=expected, got=f"{self.distance_mm:g} mm")


@output_kind
class FocusVideo(ClipOptions, ShownVideo):
    """The focus runs through depth."""

    kind: Literal["focus"] = "focus"
    name: Name = "focus"
    from_mm: DepthMm | None = None
    """Where the focus starts, s of the display; when not given the scene's far end, or -n f where it is not known, as
    far as neighbouring views overlap."""
    to_mm: DepthMm | None = None
    """Where it turns back; when not given the scene's near end, or n f, as far as neighbouring views overlap."""
    planes: int = Field(default=48, ge=2, le=1000)
    """How many depths are told apart on the way."""

    @model_validator(mode="after")
    def _runs(self) -> Self:
        if self.from_mm is not None and self.from_mm == self.to_mm:
            raise Misfit("to_mm", expected="another depth than from_mm", got=f"{self.to_mm:g} mm")
        return self

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a depth so far off that neighbouring views do not overlap."""
        super().check(rig, frames)
        largest_mm = rig.layout.overlap_depth(rig.lens_array.focal_length_mm)
        for field, depth_mm in (("from_mm", self.from_mm), ("to_mm", self.to_mm)):
            if depth_mm is not None and abs(depth_mm) > largest_mm:
                expected = f"at most {largest_mm:.6g} mm from the display, where neighbouring views overlap"
                raise Misfit(field, expected=expected, got=f"{depth_mm:g} mm")


def least_sweep_mm(array: LensArray, px_per_lens: int) -> float:
    """Return from how near no place before the display sees all lenses, mm.

    A lens shows its outermost pixel at a slope of (p / 2 f) (n - 1) / n, and the outermost lenses stand half the
    array from the middle.
    """
    span_pitches = max(array.lenses_mm.span) / array.pitch_mm
    return span_pitches * array.focal_length_mm * px_per_lens / (px_per_lens - 1)
