"""Videos for two eyes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.fields.problems import FieldError
from lippmann.job.optics.rig import Rig
from lippmann.job.optics.viewing import EYES_APART_MM
from lippmann.job.outputs.output import Name, output_kind
from lippmann.job.outputs.videos import Repeat, ShownVideo
from lippmann.job.outputs.view_block import check_view

Index = Annotated[int, Field(ge=0)]
View = tuple[Index, Index]
"""The view (u, v)."""


class PairOptions(ShownVideo):
    """The base of videos for two eyes: two eyes in front of the display, or two views."""

    eye_distance_mm: float | None = Field(default=None, gt=0, le=10_000)
    """The distance between the eyes; the default is 63 mm."""
    distance_mm: float | None = Field(default=None, gt=0, le=1e6)
    """The distance from the display to the eyes; the default is `display.viewing_distance_mm`."""
    views: tuple[View, View] | None = None
    """The views of the left and of the right eye, each as (u, v), instead of the eyes' places."""
    repeat: Repeat = 1
    """The number of times that the sequence is shown."""

    @model_validator(mode="after")
    def _given_once(self) -> Self:
        if self.views is not None and (self.eye_distance_mm is not None or self.distance_mm is not None):
            raise FieldError("views", expected="either these, or eye_distance_mm and distance_mm", got="both")
        return self

    @property
    def apart_mm(self) -> float:
        """The distance between the eyes."""
        return self.eye_distance_mm or EYES_APART_MM

    def least_mm(self, rig: Rig) -> float:
        """Return the least distance from which both eyes see their views of the middle lens."""
        return self.apart_mm * rig.lens_array.focal_length_mm / rig.lens_array.pitch_mm

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse views that do not exist."""
        super().check(rig, frames)
        if self.views is not None:
            for eye, view in enumerate(self.views):
                check_view(f"views.{eye}", rig, view)

    def check_viewing(self, rig: Rig, viewing_distance_mm: float) -> None:
        """Refuse eyes that are too near to see their views of the middle lens."""
        distance_mm = self.distance_mm or viewing_distance_mm
        if self.views is None and distance_mm < self.least_mm(rig):
            expected = f"at least {self.least_mm(rig):.6g} mm, where both eyes see the display's middle lens"
            raise FieldError("distance_mm", expected=expected, got=f"{distance_mm:g} mm")


@output_kind
class StereoVideo(PairOptions):
    """A video of what two eyes see, side by side."""

    kind: Literal["stereo"] = "stereo"
    name: Name = "stereo"
    order: Literal["side_by_side", "cross_eyed"] = "side_by_side"
    """`side_by_side`: the left eye's picture is on the left; `cross_eyed`: on the right, for viewing with crossed
    eyes."""
    packing: Literal["full", "half"] = "full"
    """`half`: each picture at half its width, as for 3D television."""

    @model_validator(mode="after")
    def _halves_are_whole(self) -> Self:
        if self.packing == "half" and self.scale is not None and self.scale % 2:
            raise FieldError("scale", expected="an even number with packing half", got=self.scale)
        return self

    def longest_lenses(self, rig: Rig) -> int:
        """Return the number of lenses along the longer side of a picture, which has two pictures side by side."""
        rows, cols = rig.lens_array.count
        return max(rows, cols if self.packing == "half" else 2 * cols)


@output_kind
class AnaglyphVideo(PairOptions):
    """A video of what two eyes see, in one picture for red-cyan glasses, red on the left."""

    kind: Literal["anaglyph"] = "anaglyph"
    name: Name = "anaglyph"
