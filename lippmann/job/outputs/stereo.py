"""Videos for two eyes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from lippmann.job.outputs.output import Name, output_kind
from lippmann.job.outputs.videos import Repeat, ShownVideo
from lippmann.job.outputs.view_block import check_view
from lippmann.job.problems import Misfit
from lippmann.job.rig import Rig
from lippmann.job.viewing import EYES_APART_MM

Index = Annotated[int, Field(ge=0)]
View = tuple[Index, Index]
"""As (u, v)."""


class PairOptions(ShownVideo):
    """What they have: two eyes before the display, or two views."""

    eye_distance_mm: float | None = Field(default=None, gt=0, le=10_000)
    """From eye to eye; 63 mm when not given."""
    distance_mm: float | None = Field(default=None, gt=0, le=1e6)
    """From the display to the eyes; `display.viewing_distance_mm` when not given."""
    views: tuple[View, View] | None = None
    """In place of eyes at a place: the left eye's view and the right eye's, each as (u, v)."""
    repeat: Repeat = 1

    @model_validator(mode="after")
    def _said_once(self) -> Self:
        if self.views is not None and (self.eye_distance_mm is not None or self.distance_mm is not None):
            raise Misfit("views", expected="either these, or eye_distance_mm and distance_mm", got="both")
        return self

    @property
    def apart_mm(self) -> float:
        """From eye to eye."""
        return self.eye_distance_mm or EYES_APART_MM

    def least_mm(self, rig: Rig) -> float:
        """Return from how near both eyes see the display's middle lens: half their distance, over its slope."""
        return self.apart_mm * rig.lens_array.focal_length_mm / rig.lens_array.pitch_mm

    def check(self, rig: Rig, frames: Sequence[int]) -> None:
        """Refuse views that do not exist."""
        super().check(rig, frames)
        if self.views is not None:
            for eye, view in enumerate(self.views):
                check_view(f"views.{eye}", rig, view)

    def check_viewing(self, rig: Rig, viewing_distance_mm: float) -> None:
        """Refuse eyes so near that they look past the middle lens."""
        distance_mm = self.distance_mm or viewing_distance_mm
        if self.views is None and distance_mm < self.least_mm(rig):
            expected = f"at least {self.least_mm(rig):.6g} mm, where both eyes see the display's middle lens"
            raise Misfit("distance_mm", expected=expected, got=f"{distance_mm:g} mm")


@output_kind
class StereoVideo(PairOptions):
    """What two eyes see, side by side."""

    kind: Literal["stereo"] = "stereo"
    name: Name = "stereo"
    order: Literal["side_by_side", "cross_eyed"] = "side_by_side"
    """`side_by_side`: the left eye's picture is on the left; `cross_eyed`: on the right, for whoever squints."""
    packing: Literal["full", "half"] = "full"
    """`half`: each at half its width, as 3D television takes it."""

    @model_validator(mode="after")
    def _halves_are_whole(self) -> Self:
        if self.packing == "half" and self.scale is not None and self.scale % 2:
            raise Misfit("scale", expected="an even number with packing half", got=self.scale)
        return self

    def longest_lenses(self, rig: Rig) -> int:
        """Return how many lenses the longer side of a picture shows: two pictures stand side by side."""
        rows, cols = rig.lens_array.count
        return max(rows, cols if self.packing == "half" else 2 * cols)


@output_kind
class AnaglyphVideo(PairOptions):
    """What two eyes see, in one picture for red-cyan glasses, red on the left."""

    kind: Literal["anaglyph"] = "anaglyph"
    name: Name = "anaglyph"
