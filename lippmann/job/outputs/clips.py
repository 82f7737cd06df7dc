"""Videos with a motion of their own: of the eye, of the focus."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.animation.frames import format_frames
from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import LensArray, Rig
from lippmann.job.outputs.output import Name, OutputOptions, output_kind
from lippmann.job.outputs.videos import Fps, ShownVideo

DepthMm = Annotated[float, Field(ge=-1e6, le=1e6)]


class ClipOptions(OutputOptions):
    """The options of clips: their length, and whether the scene moves."""

    fps: Fps = 24.0
    """Pictures per second; the scene keeps its own speed."""
    seconds: float | None = Field(default=None, gt=0, le=3600)
    """The length; the default is four seconds per period, extended to the end of the sequence."""
    periods: int = Field(default=1, ge=1, le=1000)
    """The number of periods of the motion; it is whole, so that the clip repeats without a jump."""
    frame: int | None = Field(default=None, ge=1)
    """The frame that the clip shows; by default the frames play, and start again after the last one."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a frame that the job does not have."""
        super().check(rig, frames)
        if self.frame is not None and self.frame not in frames:
            raise FieldError("frame", expected=f"one of the job's frames, {format_frames(frames)}", got=self.frame)


@output_kind
class SweepVideo(ClipOptions, ShownVideo):
    """A video of an eye that moves in front of the display."""

    kind: Literal["sweep"] = "sweep"
    name: Name = "sweep"
    path: Literal["horizontal", "vertical", "circle"] = "horizontal"
    """The path of the eye."""
    extent: float = Field(default=0.9, gt=0, le=1)
    """The amplitude as a share of the range of the views: 1 goes from the first view to the last."""
    distance_mm: float | None = Field(default=None, gt=0, le=1e6)
    """The distance of the eye; the default is infinite, which shows the views and pictures between them."""

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse an eye that is too near to see all lenses from any place."""
        super().check(rig, frames)
        least_mm = least_sweep_mm(rig.lens_array, rig.px_per_lens)
        if self.distance_mm is not None and self.distance_mm < least_mm:
            expected = f"at least {least_mm:.6g} mm, where an eye sees light of all lenses"
            raise FieldError("distance_mm", expected=expected, got=f"{self.distance_mm:g} mm")


@output_kind
class FocusVideo(ClipOptions, ShownVideo):
    """A video of a focus that moves through depth."""

    kind: Literal["focus"] = "focus"
    name: Name = "focus"
    from_mm: DepthMm | None = None
    """The depth s of the display at which the focus starts; the default is the far end of the scene, or -n f where it
    is not known, as far as neighbouring views overlap."""
    to_mm: DepthMm | None = None
    """The depth at which the focus turns back; the default is the near end of the scene, or n f, as far as neighbouring
    views overlap."""
    planes: int = Field(default=48, ge=2, le=1000)
    """The number of depths between the two ends."""

    @model_validator(mode="after")
    def _runs(self) -> Self:
        if self.from_mm is not None and self.from_mm == self.to_mm:
            raise FieldError("to_mm", expected="another depth than from_mm", got=f"{self.to_mm:g} mm")
        return self

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse a depth at which neighbouring views do not overlap."""
        super().check(rig, frames)
        largest_mm = rig.layout.overlap_depth(rig.lens_array.focal_length_mm)
        for field, depth_mm in (("from_mm", self.from_mm), ("to_mm", self.to_mm)):
            if depth_mm is not None and abs(depth_mm) > largest_mm:
                expected = f"at most {largest_mm:.6g} mm from the display, where neighbouring views overlap"
                raise FieldError(field, expected=expected, got=f"{depth_mm:g} mm")


def least_sweep_mm(array: LensArray, px_per_lens: int) -> float:
    """Return the least distance from which some place in front of the display sees all lenses, mm.

    A lens shows its outermost pixel at a slope of (p / 2 f) (n - 1) / n, and the outermost lenses stand half the
    array from the middle.
    """
    span_pitches = max(array.lenses_mm.span) / array.pitch_mm
    return span_pitches * array.focal_length_mm * px_per_lens / (px_per_lens - 1)
